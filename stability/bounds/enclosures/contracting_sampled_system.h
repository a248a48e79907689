/// @file The sampled loop in intervals, in coordinates in which it is verified to contract. Not for users.
#pragma once

#include <optional>

#include "stability/bounds/enclosures/interval_matrix.h"
#include "stability/bounds/loops/sampled_loop.h"

namespace swarmcert::stability {

/// Enclosures of the matrices of SampledModel. The integral is omitted if Ki is 0, as nothing reads it. A delay within
/// 1e-9 periods of a whole number of periods is treated as that number.
class IntervalSampledModel {
 public:
  explicit IntervalSampledModel(const SampledLoop& loop);

  std::size_t size() const { return command_ + past_; }  ///< e, e', lag outputs, I, past commands
  std::size_t lags() const { return plant_ - 2; }
  std::size_t past() const { return past_; }
  std::size_t command_index() const { return command_; }      ///< of the new command after control
  const IntervalMatrix& control() const { return control_; }  ///< [size + 1 x size]
  const IntervalMatrix& hold() const { return hold_; }        ///< [size x size + 1]
  /// Returns the row over the state after the control that gives e at `phase_s` into the period.
  IntervalVector error_at(double phase_s) const;

 private:
  /// Returns the plant's state at `phase` as rows over the state after the control, [plant x size + 1].
  IntervalMatrix plant_at(Interval phase_s) const;

  std::size_t plant_ = 0, command_ = 0, past_ = 0, newest_ = 0;
  Interval shift_s_;  ///< part of a period during which the older command still acts
  IntervalMatrix generator_, control_, hold_;
};

/// Rows over the states of a period map to the period before by row -> row A, A = R M R^-1, after the change of
/// coordinates row = (old row) R^-1. |A|_2 <= gamma < 1 is verified (interval Cholesky of gamma^2 I - A'A); R'R solves
/// a Stein equation.
struct ContractingSampledSystem {
  IntervalMatrix A;
  Eigen::MatrixXd R;
  IntervalMatrix R_inverse;
  double gamma = 1;
};

/// Returns nothing if stability could not be verified.
std::optional<ContractingSampledSystem> contracting(const IntervalSampledModel& model);

}  // namespace swarmcert::stability
