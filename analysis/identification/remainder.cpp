#include "analysis/identification/remainder.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "analysis/residuals/comparison.h"

namespace swarmcert::identification {
namespace {

constexpr double kLeastExplained =
    0.02;  ///< of the squared residual explained by the means over a variable's regions

}  // namespace

residuals::Inputs inputs_with(const Passes& passes, const std::vector<stability::EffectSpec>& specs) {
  residuals::Inputs inputs = passes.inputs;
  inputs.models = {with_effects(*inputs.model_of(passes.kind), specs)};
  for (auto& [vehicle, model] : inputs.vehicle_models) model = with_effects(model, specs);
  std::vector<residuals::FlightFiles> flights;
  for (const int i : passes.flights) flights.push_back(inputs.found.flights[static_cast<std::size_t>(i)]);
  inputs.found.flights = flights;
  return inputs;
}

Remainder remainder(const Passes& passes, const std::vector<stability::EffectSpec>& specs) {
  const residuals::Inputs inputs = inputs_with(passes, specs);
  const residuals::Leftover left = residuals::left_over(inputs, passes.jobs);
  Remainder result;
  for (int axis = 0; axis < 3; ++axis) {
    const double ratio = left.low_band_to_floor[axis];
    if (std::isfinite(ratio)) result.ratio = std::max(result.ratio, ratio);
  }
  result.flag = result.ratio > residuals::Spectrum::kSlowToFloor;
  result.line = left.line;
  result.floor_N2 = left.noise_floor_N.squaredNorm();
  result.excess_N2 = std::max(left.rmse_N * left.rmse_N - result.floor_N2, 0.0);
  if (result.line.is_found()) result.depends_on.emplace_back("vibration");
  if (!result.flag) return result;
  std::array<double, residuals::kNumVariables> shares = left.region_shares;
  for (int rank = 0; rank < residuals::kNumVariables; ++rank) {
    const auto largest = std::max_element(shares.begin(), shares.end());
    if (*largest < kLeastExplained) break;
    result.depends_on.emplace_back(residuals::variable_name(static_cast<int>(largest - shares.begin())));
    *largest = 0;
  }
  return result;
}

}  // namespace swarmcert::identification
