/// @file Assertions on enclosures.
#pragma once

#include <gtest/gtest.h>

#include <optional>

#include "nn/base/interval.h"
#include "stability/bounds/enclosures/kernel_cells.h"
#include "stability/bounds/loops/impulse_response.h"

namespace swarmcert::tests {

/// Succeeds if `interval` contains a number within `estimate_error` (relative) of `value`, and its width is positive
/// and below `relative_width`.
inline testing::AssertionResult encloses(const Interval& interval, double value, double relative_width,
                                         double estimate_error = 0) {
  if (!(interval.lower <= value * (1 + estimate_error) && value * (1 - estimate_error) <= interval.upper)) {
    return testing::AssertionFailure()
           << value << " is not in [" << interval.lower << ", " << interval.upper << "]";
  }
  if (!(interval.upper > interval.lower)) return testing::AssertionFailure() << "no width at " << value;
  const double width = (interval.upper - interval.lower) / value;
  if (!(width < relative_width)) return testing::AssertionFailure() << "width " << width;
  return testing::AssertionSuccess();
}

/// The cells of one response without a delay.
inline std::optional<stability::KernelCells> cells_of(const stability::TransferFunction& y, double cell_s,
                                                      int count) {
  const stability::Polynomial denominator = stability::sum(y.denominator, y.feedback);
  return stability::kernel_cells({y.numerator.begin(), y.numerator.end()},
                                 {denominator.begin(), denominator.end()}, cell_s, count);
}

}  // namespace swarmcert::tests
