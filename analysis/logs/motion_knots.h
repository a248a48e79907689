/// @file Columns of several clocks as smooth series on common, sparse times, so that physics can compare them.
#pragma once

#include <vector>

#include "analysis/logs/raw_log.h"

namespace swarmcert::logs {

/// A column at the knots.
struct KnotSeries {
  std::vector<double> value,
      slope;  ///< of the line through the records around each knot; NaN: too few records
};

/// Times at which a log is judged: at most kMost, half a window apart, from the middle of a long log.
struct Knots {
  static constexpr std::size_t kMost = 600;
  std::vector<double> time_s;
  double window_s = 0, step_s = 0;

  /// Independent samples of a motion of a few hertz in `count` knots.
  double independent(std::size_t count) const;
};

/// Returns the knots of the topic with the most records among those that are plain tables; none without times.
Knots knots_of(const RawLog& log);

/// Fits lines to `values` [records of the topic] around each knot.
KnotSeries at_knots(const Knots& knots, const std::vector<double>& time_s, const std::vector<double>& values);

/// Returns (s[i+1] - s[i-1]) / (t[i+1] - t[i-1]).
std::vector<double> difference_of(const Knots& knots, const std::vector<double>& series);

}  // namespace swarmcert::logs
