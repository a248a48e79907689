/// @file What tests ask of an enclosure.
#pragma once

#include <gtest/gtest.h>

#include "stability/bounds/interval.h"

namespace swarmcert::tests {

/// `interval` holds a number within `estimate_error` (relative) of `value`, has a width, and one below
/// `relative_width`.
inline testing::AssertionResult encloses(const stability::Interval& interval, double value,
                                         double relative_width, double estimate_error = 0) {
  if (!(interval.lo <= value * (1 + estimate_error) && value * (1 - estimate_error) <= interval.hi)) {
    return testing::AssertionFailure()
           << value << " is not in [" << interval.lo << ", " << interval.hi << "]";
  }
  if (!(interval.hi > interval.lo)) return testing::AssertionFailure() << "no width at " << value;
  const double width = (interval.hi - interval.lo) / value;
  if (!(width < relative_width)) return testing::AssertionFailure() << "width " << width;
  return testing::AssertionSuccess();
}

}  // namespace swarmcert::tests
