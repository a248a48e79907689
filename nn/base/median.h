/// @file The median.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace swarmcert {

/// Returns the middle one of `values`, the larger of two; 0 if there are none.
inline double upper_median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace swarmcert
