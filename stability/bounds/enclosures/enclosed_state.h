/// @file The state of a contracting linear system, enclosed step by step in time. Not for users.
#pragma once

#include <vector>

#include "stability/bounds/enclosures/interval_matrix.h"

namespace swarmcert::stability {

/// exp(A step) up to `remainder` in the 2-norm.
struct EnclosedStep {
  IntervalMatrix matrix;
  double remainder = 0;

  /// @param size upper bound on |A| step, at most 1.
  EnclosedStep(const IntervalMatrix& A, double step_s, double size);
};

/// The true state is within `error` of w in the 2-norm.
struct EnclosedState {
  std::vector<double> w;
  double error = 0;

  explicit EnclosedState(const IntervalVector& initial);

  double largest_norm() const;
  /// Encloses row x state. @param row_norm upper bound on |row|.
  Interval value(const IntervalVector& row, double row_norm) const;
  /// The flow contracts, so that the previous error does not grow.
  void advance(const EnclosedStep& step);
};

}  // namespace swarmcert::stability
