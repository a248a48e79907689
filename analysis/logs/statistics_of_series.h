/// @file Robust statistics of series with gaps.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace swarmcert::logs {

/// Marks a value that the log does not have.
inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Returns a quantile of the finite values; NaN if there are none.
inline double quantile_of(std::vector<double> values, double share) {
  values.erase(std::remove_if(values.begin(), values.end(), [](double x) { return !std::isfinite(x); }),
               values.end());
  if (values.empty()) return std::nan("");
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

inline double median(const std::vector<double>& values) { return quantile_of(values, 0.5); }

inline bool holds_numbers(const std::vector<double>& values) {
  return std::any_of(values.begin(), values.end(), [](double x) { return std::isfinite(x); });
}

/// Returns the mean of the finite values; 0 if there are none.
inline double mean_of(const std::vector<double>& values) {
  double sum = 0, count = 0;
  for (const double value : values)
    if (std::isfinite(value)) sum += value, ++count;
  return count > 0 ? sum / count : 0;
}

/// Returns the differences between neighbours.
inline std::vector<double> steps_of(const std::vector<double>& values) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < values.size(); ++i) steps.push_back(values[i] - values[i - 1]);
  return steps;
}

/// Returns the correlation over the records where both values are finite; 0 with fewer than three or without changes.
inline double correlation_of(const std::vector<double>& x, const std::vector<double>& y) {
  const auto for_each_pair = [&](const auto& use) {
    for (std::size_t i = 0; i < x.size(); ++i)
      if (std::isfinite(x[i]) && std::isfinite(y[i])) use(x[i], y[i]);
  };
  double n = 0, sx = 0, sy = 0, xx = 0, xy = 0, yy = 0;
  for_each_pair([&](double a, double b) { ++n, sx += a, sy += b; });
  for_each_pair([&, mx = sx / n, my = sy / n](double a, double b) {
    xx += (a - mx) * (a - mx), xy += (a - mx) * (b - my), yy += (b - my) * (b - my);
  });
  return n >= 3 && xx > 0 && yy > 0 ? xy / std::sqrt(xx * yy) : 0;
}

}  // namespace swarmcert::logs
