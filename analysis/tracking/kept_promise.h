/// @file How often a promise of `bound --coverage` held on flights that were not used to make it.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "analysis/residuals/flight_peaks.h"
#include "nn/base/interval.h"

namespace swarmcert::analysis {

/// The promise for a further flight stated by a result of bound --coverage.
struct Promise {
  std::string path;
  double level = 0;
  /// Bound in the force channel, from the sampled loop if there is one, otherwise from the continuous loop. Infinite:
  /// no bound.
  std::array<double, 3> bound_m{};
  std::vector<std::string> made_from;  ///< SHA-256 of the logs used
};

/// Reads a promise.
/// @throws files::InputError if the file is not such a result.
Promise read_promise(const std::string& path);

struct KeptAlong {
  int flights = 0;  ///< flights with a setpoint along the axis
  int held = 0;     ///< of these, the flights in which no vehicle exceeded the bound
  /// 90 % confidence interval (Clopper and Pearson 1934) of the probability that a flight stays below; 0 to 1 without
  /// flights.
  Interval interval_90{0, 1};

  double share() const { return flights == 0 ? 0 : static_cast<double>(held) / flights; }
};

struct KeptPromise {
  std::array<KeptAlong, 3> axes;
  std::vector<std::string> used;  ///< logs from which the promise was made; their whole flights are left out
  /// Among the axes with flights, the one with the smallest share of flights that held; -1 if there is none.
  int worst_axis() const;
};

/// Counts flights that held the promise. Flights with a log from which the promise was made are not counted.
/// @throws files::InputError if a log cannot be read.
KeptPromise kept_promise(const Promise& promise, const std::vector<residuals::FlightPeak>& peaks);

}  // namespace swarmcert::analysis
