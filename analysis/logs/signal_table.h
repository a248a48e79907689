/// @file All signals of a log on one clock in SI units, from which samples are made.
#pragma once

#include <array>
#include <vector>

#include "analysis/logs/recognition.h"

namespace swarmcert::logs {

/// Rz(yaw) Ry(pitch) Rx(roll)
Attitude attitude_of_angles(double roll, double pitch, double yaw);

/// One column per Signal with one value per record; empty if no column of the log carries the signal.
struct SignalTable {
  std::vector<double> time_us;  ///< strictly increasing
  std::vector<char> restarts;   ///< first record, or after a pause longer than longest_gap_s(step)
  std::array<std::vector<double>, kNumSignals> values;

  std::size_t size() const { return time_us.size(); }
  bool has(int signal) const { return !values[static_cast<std::size_t>(signal)].empty(); }
  bool has_group(int first, int count) const {
    for (int k = 0; k < count; ++k) {
      if (!has(first + k)) return false;
    }
    return true;
  }
  std::vector<double>& operator[](int signal) { return values[static_cast<std::size_t>(signal)]; }
  const std::vector<double>& operator[](int signal) const { return values[static_cast<std::size_t>(signal)]; }
  Vector three(int first, std::size_t record) const {
    return {(*this)[first][record], (*this)[first + 1][record], (*this)[first + 2][record]};
  }
  /// Returns the attitude from the four columns starting at kAttitude.
  Attitude attitude(std::size_t record) const {
    const Vector xyz = three(kAttitude, record);
    return {xyz[0], xyz[1], xyz[2], (*this)[kAttitude + 3][record]};
  }
  /// Returns the median step between records in seconds; 0 if there are fewer than two. Goes through all records.
  double step_s() const;
};

/// Brings the recognised columns onto the clock of `recognition.clock`: units are converted as named, wraps of 16-bit
/// integers are undone, faster topics are averaged and slower ones interpolated. Records with non-finite signals or
/// with invalid times are dropped and counted in `health`: a time must be later than the previous one, and a step of
/// more than ten seconds is accepted only if the next record confirms it. The 32-bit tick may wrap.
/// @param events  receives the wraps and saturations of 16-bit integers
SignalTable signal_table(const RawLog& log, const Recognition& recognition, LogHealth& health,
                         std::vector<LogEvent>& events);

/// Returns the longest step between neighbouring records in a log with this median step: kLongestGap_s, or two and a
/// half steps in slow logs.
double longest_gap_s(double step_s);

/// Removes jumps of a whole turn from angles, so that they can be interpolated.
void unwrap(std::vector<double>& angles_rad);

}  // namespace swarmcert::logs
