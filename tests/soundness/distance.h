#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

namespace swarmcert::tests {

/// Round-off of two evaluations in double, relative to the slope, for points at least kLeastDistance apart.
constexpr double kRounding = 1e-7;
constexpr double kLeastDistance = 1e-4;

inline double distance(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return std::sqrt(sum);
}

}  // namespace swarmcert::tests
