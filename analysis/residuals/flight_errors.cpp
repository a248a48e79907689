#include "analysis/residuals/flight_errors.h"

#include "analysis/residuals/force_residual.h"
#include "nn/base/parallel.h"

namespace swarmcert::residuals {

std::vector<FlightError> flight_errors(const Inputs& inputs, int jobs) {
  const std::size_t count = inputs.found.flights.size();
  std::vector<std::vector<FlightError>> by_flight(count);
  files::parallel_for(static_cast<int>(count), jobs, [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    std::vector<std::string> problems;  // compare() has told them
    for (const Track& track : inputs.load(k, problems)) {
      if (track.position_only || track.used == 0) continue;
      const std::vector<Eigen::Vector3d> r =
          force_residual(inputs.model_for(track), inputs.kinds, inputs.rules, track);
      const std::vector<ErrorWindow> windows = error_windows(track, r);
      if (windows.empty()) continue;
      FlightError error;
      error.path = track.path;
      error.windows = windows.size();
      error.largest = windows.front();
      for (const ErrorWindow& window : windows) {
        error.largest.amplitude = error.largest.amplitude.cwiseMax(window.amplitude);
        error.largest.rate = error.largest.rate.cwiseMax(window.rate);
        error.largest.variation = error.largest.variation.cwiseMax(window.variation);
        error.largest.impulse = error.largest.impulse.cwiseMax(window.impulse);
      }
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      for (std::size_t n = 0; n < r.size(); ++n)
        if (track.cut[n] == Cut::kNone) sum += r[n];
      error.bias = with_norm(sum / static_cast<double>(track.used));
      by_flight[k].push_back(std::move(error));
    }
  });
  std::vector<FlightError> result;
  for (std::vector<FlightError>& some : by_flight) result.insert(result.end(), some.begin(), some.end());
  return result;
}

}  // namespace swarmcert::residuals
