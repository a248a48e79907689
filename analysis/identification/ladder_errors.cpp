#include "analysis/identification/ladder_errors.h"

#include <cmath>

#include "analysis/identification/rotors/rotor_fit.h"
#include "analysis/residuals/comparison.h"
#include "analysis/residuals/force_residual.h"
#include "nn/base/parallel.h"

namespace swarmcert::identification {

std::vector<FlightSquares> squares_of(residuals::Inputs inputs, const stability::Model& model,
                                      const std::vector<int>& which, int jobs) {
  inputs.models = {model};
  std::vector<FlightSquares> all(which.size());
  files::parallel_for(static_cast<int>(which.size()), jobs, [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    std::vector<std::string> problems;
    for (const residuals::Track& track : inputs.load(static_cast<std::size_t>(which[k]), problems)) {
      if (track.position_only) continue;
      const auto r = residuals::force_residual(inputs.model_for(track), inputs.kinds, inputs.rules, track);
      for (std::size_t s = 0; s < r.size(); ++s) {
        if (track.cut[s] != residuals::Cut::kNone) continue;
        all[k].sum += r[s].squaredNorm();
        all[k].count += 1;
      }
    }
  });
  return all;
}

double rmse_N(const std::vector<FlightSquares>& flights) {
  FlightSquares all;
  for (const FlightSquares& flight : flights) {
    all.sum += flight.sum;
    all.count += flight.count;
  }
  return all.count > 0 ? std::sqrt(all.sum / all.count) : 0;
}

bool rises_anywhere(const std::vector<FlightSquares>& before, const std::vector<FlightSquares>& after) {
  constexpr double kRisesBy = 0.005;
  for (std::size_t k = 0; k < before.size(); ++k)
    if (rmse_N({after[k]}) > (1 + kRisesBy) * rmse_N({before[k]})) return true;
  return false;
}

residuals::Inputs only_flights(residuals::Inputs inputs, const std::vector<int>& which) {
  std::vector<residuals::FlightFiles> flights;
  for (const int i : which) flights.push_back(inputs.found.flights[static_cast<std::size_t>(i)]);
  inputs.found.flights = std::move(flights);
  return inputs;
}

double noise_floor_N(residuals::Inputs inputs, const stability::Model& model, const std::vector<int>& which,
                     int jobs) {
  inputs = only_flights(std::move(inputs), which);
  inputs.models = {model};
  const double floor_N = residuals::compare(inputs, jobs, [](int, int) {}).overall.noise_floor_N.norm();
  return std::isfinite(floor_N) ? floor_N : 0;
}

std::optional<double> imbalance_N(const residuals::Inputs& inputs, const stability::Model& model,
                                  const std::vector<int>& which, int jobs) {
  const std::vector<RotorLoads> loads = rotor_loads(only_flights(inputs, which), model.kind, jobs);
  if (loads.empty()) return std::nullopt;
  return rotor_imbalance_N(loads, rotor_factors_of(model));
}

}  // namespace swarmcert::identification
