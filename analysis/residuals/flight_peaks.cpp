#include "analysis/residuals/flight_peaks.h"

#include <algorithm>
#include <cmath>

#include "analysis/residuals/over_tracks.h"

namespace swarmcert::residuals {
namespace {

/// Returns NaN if the axis has no setpoint at all.
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
  return over_tracks<FlightPeak>(inputs, jobs, [](const Track& track, std::vector<FlightPeak>& peaks) {
    if (track.used == 0) return;
    peaks.push_back({track.flight,
                     track.vehicle,
                     track.path,
                     {peak_along(track, 0), peak_along(track, 1), peak_along(track, 2)}});
  });
}

}  // namespace swarmcert::residuals
