/// @file How often a promise of `bound --coverage` held on flights that it was not made from.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "analysis/residuals/flight_peaks.h"
#include "nn/base/interval.h"

namespace swarmcert::analysis {

/// What a result of bound --coverage promises of a further flight.
struct Promise {
  std::string path;
  double level = 0;
  /// Of the force channel: the sampled loop where there is one, else the continuous one. Infinite: no bound.
  std::array<double, 3> bound_m{};
  std::vector<std::string> made_from;  ///< sha256 of the logs
};

/// @throws files::InputError where the file is no such result.
Promise read_promise(const std::string& path);

struct KeptAlong {
  int flights = 0;  ///< with a set point along the axis
  int held = 0;     ///< of these, flights in which no vehicle exceeded the bound
  /// 90 % interval (Clopper and Pearson 1934) of the probability that a flight stays below; 0 to 1 without flights.
  Interval interval_90{0, 1};

  double share() const { return flights == 0 ? 0 : static_cast<double>(held) / flights; }
};

struct KeptPromise {
  std::array<KeptAlong, 3> axes;
  std::vector<std::string> used;  ///< logs that the promise was made from, left out with all of their flight
  /// Of the axes with flights, the one along which the smallest share held; -1 without.
  int worst_axis() const;
};

/// A flight whose logs include one that the promise was made from counts nowhere.
/// @throws files::InputError where a log cannot be read.
KeptPromise kept_promise(const Promise& promise, const std::vector<residuals::FlightPeak>& peaks);

}  // namespace swarmcert::analysis
