/// @file Matrices of the sampled loop. Not for users.
#pragma once

#include <Eigen/Core>

#include "stability/bounds/loops/sampled_loop.h"

namespace swarmcert::stability {

/// exp(A t) for a small matrix, by scaling and squaring of the Taylor series.
Eigen::MatrixXd exponential(const Eigen::MatrixXd& At);

/// State before the control of a period: e, e', the lags' outputs, I, past commands (newest first). After it: the same
/// with the new command before the past ones. Commands are accelerations.
class SampledModel {
 public:
  explicit SampledModel(const SampledLoop& loop);

  Eigen::Index size() const { return plant_ + 1 + past_; }
  /// Before control -> after control, [size + 1 x size].
  const Eigen::MatrixXd& control() const { return control_; }
  /// After control -> before the next control, [size x size + 1].
  const Eigen::MatrixXd& hold() const { return hold_; }
  /// Row that gives e at `phase_s` into a period from the state after its control.
  Eigen::RowVectorXd error_at(double phase_s) const;
  /// What an error of 1 of the measured position, or velocity, adds to the state after control, [size + 1].
  Eigen::VectorXd measured_position() const { return control_.col(0) - Eigen::VectorXd::Unit(size() + 1, 0); }
  Eigen::VectorXd measured_velocity() const { return control_.col(1) - Eigen::VectorXd::Unit(size() + 1, 1); }
  Eigen::Index integral_index() const { return plant_; }
  /// Where the new command stands after control.
  Eigen::Index command_index() const { return plant_ + 1; }

 private:
  /// The plant's state `duration_s` later, [plant x plant + 1], under a held command (last column).
  Eigen::MatrixXd plant_step(double duration_s) const;
  /// Plant's state at `phase_s` as rows over the state after control.
  Eigen::MatrixXd plant_at(double phase_s) const;

  SampledLoop loop_;
  Eigen::Index plant_ = 0;   ///< e, e', lags
  Eigen::Index past_ = 0;    ///< past commands that are still to act
  double shift_s_ = 0;       ///< part of a period for which the older command still acts
  Eigen::Index newest_ = 0;  ///< command that acts after shift_s_, counted from the new one
  Eigen::MatrixXd generator_;
  Eigen::MatrixXd control_;
  Eigen::MatrixXd hold_;
};

}  // namespace swarmcert::stability
