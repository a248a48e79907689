/// @file Hypotheses: a group of columns read as a signal, with unit, frame, sign and order; and columns of several
/// clocks as smooth series on common, sparse times, so that physics can compare them.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "analysis/logs/column_groups.h"
#include "analysis/logs/recognition.h"

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

/// Bits against a unit that people rarely use and that no name states.
inline constexpr double kOtherUnit = 9;

using ThreeSeries = std::array<std::vector<double>, 3>;

/// A group of columns read in one way. Series are at the knots, in SI units, with W z up and B forward, left, up; an
/// axis that the log does not have is empty.
struct Reading {
  Carried carried;
  std::string words;     ///< "position in mm, z down"
  double name_bits = 0;  ///< of the names for this quantity
  double bits = 0;       ///< the names, the unit and the frame that people use, the range of the values
  bool is_down = false;  ///< stored with y and z inverted: north, east, down; forward, right, down
  ThreeSeries value, slope;
  std::array<std::vector<double>, 9> rotation;  ///< of an attitude: B to W, by rows

  bool is_attitude() const { return !rotation[0].empty(); }
};

/// Returns the readings of a group as a quantity with the bits of its names and ranges; few if only one is possible.
std::vector<Reading> readings_of(const RawLog& log, const Knots& knots, const ColumnGroup& group,
                                 Quantity quantity);

/// Returns the readings of columns that a known name assigns, in its unit and sign first; none if it cannot be
/// compared.
std::vector<Reading> readings_of_known(const RawLog& log, const Knots& knots, const Carried& carried);

/// Returns whether both give the same columns the same signal, unit and signs.
bool is_same_reading(const Carried& a, const Carried& b);

/// Returns whether two readings give the same signal, up to a twentieth of its spread.
bool is_same_signal(const Reading& a, const Reading& b);

}  // namespace swarmcert::logs
