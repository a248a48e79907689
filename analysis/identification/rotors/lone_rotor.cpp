#include "analysis/identification/rotors/lone_rotor.h"

#include <algorithm>
#include <cmath>

#include "analysis/identification/rotors/rotor_fit.h"
#include "stability/effects/registry.h"

namespace swarmcert::identification {
namespace {

/// Returns 4 f_k / (m g) - 1 with the forces f_k of the model, including its own factors of rotors and its ratio.
Eigen::Vector4d excess_of(const RotorLoads& flight, const stability::Model& model) {
  const RotorFactors factors = rotor_factors_of(model);
  Eigen::Vector4d excess;
  for (Eigen::Index k = 0; k < excess.size(); ++k) {
    const double factor = factors[static_cast<std::size_t>(k)].value + own_thrust_ratio(model);
    excess[k] = factor * 4 * flight.mean_N[k] / model.weight_N() - 1;
  }
  return excess;
}

Eigen::Index largest_of(const Eigen::Vector4d& values) {
  Eigen::Index at = 0;
  values.maxCoeff(&at);
  return at;
}

}  // namespace

LoneRotor lone_rotor(const std::vector<RotorLoads>& flights, const stability::Model& model) {
  constexpr double kHalf = 0.5;
  Eigen::Vector4d excess = Eigen::Vector4d::Zero();
  for (const RotorLoads& flight : flights)
    excess += excess_of(flight, model) / static_cast<double>(flights.size());
  const Eigen::Index first = largest_of(excess);
  std::vector<double> sorted(excess.data(), excess.data() + excess.size());
  std::sort(sorted.begin(), sorted.end());
  const double base = (sorted[0] + sorted[1]) / 2, rise = sorted[3] - base, second = sorted[2] - base;
  const double least = 2 * kBatteryPlay_m / (model.arm_m * std::sqrt(0.5));
  const double others = (excess.sum() - excess[first]) / 3;
  LoneRotor found;
  found.share = excess.squaredNorm() > 0 ? excess[first] * excess[first] / excess.squaredNorm() : 0;
  if (!(rise > least) || second > kMostOfSecond * rise) return found;
  if (!(excess.mean() > 0) || std::abs(others) > kHalf * excess.mean()) return found;
  found.rotor = static_cast<int>(first) + 1;
  found.is_sure = found.share >= kSurelyOneRotor &&
                  std::all_of(flights.begin(), flights.end(), [&](const RotorLoads& flight) {
                    return largest_of(excess_of(flight, model)) == first;
                  });
  return found;
}

void name_lone_rotor(const residuals::Inputs& inputs, const std::string& kind, const std::vector<int>& which,
                     int jobs, std::vector<Missing>& ranking) {
  const auto ratio = std::find_if(ranking.begin(), ranking.end(), [](const Missing& missing) {
    return is_plain_scale(missing.effect) && missing.parameters.at(missing.coefficients[0]) < 0;
  });
  const stability::Model& model = *inputs.model_of(kind);
  if (ratio == ranking.end() || model.num_rotors() != 4) return;
  residuals::Inputs some = inputs;
  some.found.flights.clear();
  for (const int i : which) some.found.flights.push_back(inputs.found.flights[static_cast<std::size_t>(i)]);
  const std::vector<RotorLoads> loads = rotor_loads(some, kind, jobs);
  const auto is_other = [&](const RotorLoads& flight) { return flight.vehicle != loads.front().vehicle; };
  if (loads.empty() || std::any_of(loads.begin(), loads.end(), is_other)) return;
  const LoneRotor found = lone_rotor(loads, model);
  if (found.rotor == 0) return;
  if (!found.is_sure) {
    const std::string name = rotor_effect();
    ratio->finding.rivals.push_back({name, stability::effect_info(name).excitation});
    return;
  }
  std::vector<Missing> fitted = fit_rotors(inputs, kind, which, jobs);
  fitted[0].finding = std::move(ratio->finding);
  fitted[0].finding.model_form.clear();
  fitted[0].finding.rivals.insert(fitted[0].finding.rivals.begin(), {ratio->effect, ratio->excitation});
  *ratio = std::move(fitted[0]);
}

}  // namespace swarmcert::identification
