/// @file Matrices of the sampled loop. Not for users.
#pragma once

#include <Eigen/Core>

#include "stability/bounds/loops/sampled_loop.h"

namespace swarmcert::stability {

/// Returns exp(A t) of a small matrix, by scaling and squaring of the Taylor series.
Eigen::MatrixXd exponential(const Eigen::MatrixXd& At);

/// State before the control of a period: e, e', tilt and its rate if there is an attitude loop, lag outputs, I, past
/// commands (newest first). State after the control: the same with the new command before the past ones. Commands are
/// accelerations.
class SampledModel {
 public:
  explicit SampledModel(const SampledLoop& loop);

  Eigen::Index size() const { return plant_ + 1 + past_; }
  /// Map from before to after the control, [size + 1 x size].
  const Eigen::MatrixXd& control() const { return control_; }
  /// Map from after the control to before the next control, [size x size + 1].
  const Eigen::MatrixXd& hold() const { return hold_; }
  /// Map from one sample to the next, hold() control(). Without Ki nothing reads the integral: it then stays zero,
  /// since its eigenvalue 1 would be misleading.
  Eigen::MatrixXd map() const;
  /// Returns the row that gives e at `phase_s` into a period from the state after its control.
  Eigen::RowVectorXd error_at(double phase_s) const;
  /// Changes of the state after the control per unit error of the measured position or velocity, [size + 1].
  Eigen::VectorXd measured_position() const { return control_.col(0) - Eigen::VectorXd::Unit(size() + 1, 0); }
  Eigen::VectorXd measured_velocity() const { return control_.col(1) - Eigen::VectorXd::Unit(size() + 1, 1); }
  Eigen::Index integral_index() const { return plant_; }
  /// Index of the new command after the control.
  Eigen::Index command_index() const { return plant_ + 1; }
  /// The new command as a row over the state after the control; transposed, a unit error that is added to it.
  Eigen::RowVectorXd commanded() const { return Eigen::RowVectorXd::Unit(size() + 1, command_index()); }

 private:
  /// Adds the attitude loop to the plant: states 2 and on, before the lags.
  /// @param torque, command indices of the last lag's output and of the command in the generator; equal without lags.
  void add_attitude(Eigen::Index torque, Eigen::Index command);
  /// Returns the plant's state after `duration_s` under a held command (last column), [plant x plant + 1].
  Eigen::MatrixXd plant_step(double duration_s) const;
  /// Returns the plant's state at `phase_s` as rows over the state after the control.
  Eigen::MatrixXd plant_at(double phase_s) const;

  SampledLoop loop_;
  Eigen::Index plant_ = 0;   ///< e, e', tilt, lags
  Eigen::Index past_ = 0;    ///< past commands that are still to act
  double shift_s_ = 0;       ///< part of a period during which the older command still acts
  Eigen::Index newest_ = 0;  ///< command that acts after shift_s_, counted from the new one
  Eigen::MatrixXd generator_;
  Eigen::MatrixXd control_;
  Eigen::MatrixXd hold_;
};

}  // namespace swarmcert::stability
