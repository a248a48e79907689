/// @file The largest tracking error of every vehicle in every flight: what a promise over flights is held against.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "analysis/residuals/inputs.h"

namespace swarmcert::residuals {

struct FlightPeak {
  std::string flight, vehicle, path;  ///< path of the log
  /// sup |position - set point| over the records that compare uses, m; NaN without a set point along the axis.
  std::array<double, 3> peak_m{};
};

/// One per vehicle whose force is judged, in the order of flights. The logs are taken from the cache of `inputs`.
std::vector<FlightPeak> flight_peaks(const Inputs& inputs, int jobs);

}  // namespace swarmcert::residuals
