/// @file The largest tracking error of each vehicle in each flight, used to check guarantees over flights.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "analysis/residuals/inputs.h"

namespace swarmcert::residuals {

struct FlightPeak {
  std::string flight, vehicle, path;  ///< path of the log
  /// sup |position - setpoint| in m over the records used by compare; NaN without a setpoint along the axis.
  std::array<double, 3> peak_m{};
};

/// Returns one entry per vehicle whose force is judged, in the order of flights. Uses the log cache of `inputs`.
std::vector<FlightPeak> flight_peaks(const Inputs& inputs, int jobs);

}  // namespace swarmcert::residuals
