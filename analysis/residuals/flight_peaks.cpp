#include "analysis/residuals/flight_peaks.h"

#include <algorithm>
#include <cmath>

#include "nn/base/parallel.h"

namespace swarmcert::residuals {
namespace {

/// NaN where the axis has no set point at all.
double peak_along(const Track& track, int axis) {
  double most = std::nan("");
  for (std::size_t i = 0; i < track.targets.size(); ++i) {
    if (track.cut[i] != Cut::kNone) continue;
    const double error_m = std::abs(track.instants[i].p_W_m[axis] - track.targets[i].p_W_m[axis]);
    if (std::isfinite(error_m) && !(error_m <= most)) most = error_m;
  }
  return most;
}

}  // namespace

std::vector<FlightPeak> flight_peaks(const Inputs& inputs, int jobs) {
  const std::size_t count = inputs.found.flights.size();
  std::vector<std::vector<FlightPeak>> by_flight(count);
  files::parallel_for(static_cast<int>(count), jobs, [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    std::vector<std::string> problems;  // compare() has told them
    for (const Track& track : inputs.load(k, problems)) {
      if (track.position_only || track.used == 0) continue;
      by_flight[k].push_back({track.flight,
                              track.vehicle,
                              track.path,
                              {peak_along(track, 0), peak_along(track, 1), peak_along(track, 2)}});
    }
  });
  std::vector<FlightPeak> result;
  for (std::vector<FlightPeak>& some : by_flight) result.insert(result.end(), some.begin(), some.end());
  return result;
}

}  // namespace swarmcert::residuals
