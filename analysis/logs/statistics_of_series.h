/// @file Robust statistics of series with gaps.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

namespace swarmcert::logs {

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

/// The least squares line y = slope x + offset through the records where both values are finite.
struct Line {
  double slope = 0, offset = 0, correlation = 0, rms = 0;
  std::size_t count = 0;
};

inline Line line_through(const std::vector<double>& x, const std::vector<double>& y) {
  Line line;
  double sx = 0, sy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!std::isfinite(x[i]) || !std::isfinite(y[i])) continue;
    sx += x[i];
    sy += y[i];
    ++line.count;
  }
  if (line.count < 3) return line;
  const double n = static_cast<double>(line.count), mx = sx / n, my = sy / n;
  double xx = 0, xy = 0, yy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!std::isfinite(x[i]) || !std::isfinite(y[i])) continue;
    xx += (x[i] - mx) * (x[i] - mx);
    xy += (x[i] - mx) * (y[i] - my);
    yy += (y[i] - my) * (y[i] - my);
  }
  if (!(xx > 0) || !(yy > 0)) return line;
  line.slope = xy / xx;
  line.offset = my - line.slope * mx;
  line.correlation = xy / std::sqrt(xx * yy);
  line.rms = std::sqrt(std::max(0.0, yy - xy * xy / xx) / n);
  return line;
}

}  // namespace swarmcert::logs
