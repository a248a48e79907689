/// @file All signals of a log on one clock, in SI units: what samples are made from.
#pragma once

#include <array>
#include <vector>

#include "analysis/logs/recognition.h"

namespace swarmcert::logs {

/// One column per Signal, each with one value per record, or empty where no column of the log carries it.
struct SignalTable {
  std::vector<double> time_us;  ///< strictly increasing
  std::vector<char> restarts;   ///< first record, or a pause of more than longest_gap_s(step) before it
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
  /// From the four columns from kAttitude on.
  Attitude attitude(std::size_t record) const {
    const Vector xyz = three(kAttitude, record);
    return {xyz[0], xyz[1], xyz[2], (*this)[kAttitude + 3][record]};
  }
  /// y and z of a group change their signs: between axes forward, right, down and forward, left, up.
  void turn_half_about_x(int first);
  /// Median step between records, in seconds; 0 with fewer than two. Goes through all records.
  double step_s() const;
};

/// Brings the recognised columns onto the clock of `recognition.clock`: units as the names say, wraps of 16-bit
/// integers undone, other topics averaged where they are faster and interpolated where they are not. Records whose
/// signals are not finite or whose time does not follow are dropped and counted in `health`: a time must be later than
/// the last one; one that is over ten seconds later counts only if the next record follows it. The 32-bit tick may
/// wrap.
/// @param events  gets the wraps and the saturation of 16-bit integers.
SignalTable signal_table(const RawLog& log, const Recognition& recognition, const SignalMap& map,
                         LogHealth& health, std::vector<LogEvent>& events);

/// Records further apart are not neighbours in time, in a log of that median step: kLongestGap_s, and two and a half
/// steps of slow logs.
double longest_gap_s(double step_s);

/// The values of `series` at `times_s`: means over a step of the target where the series is faster than it, linear
/// interpolation elsewhere, NaN across gaps. Both clocks ascend.
/// @param hold  values are kept across gaps and beyond the ends, as for a battery's voltage.
std::vector<double> resampled(const std::vector<double>& from_s, const std::vector<double>& series,
                              const std::vector<double>& times_s, bool hold);

}  // namespace swarmcert::logs
