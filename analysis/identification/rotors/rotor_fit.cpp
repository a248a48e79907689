#include "analysis/identification/rotors/rotor_fit.h"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <string>

#include "stability/effects/registry.h"

namespace swarmcert::identification {
namespace {

constexpr std::size_t kRotorCount = 4;

std::string coefficient_of(std::size_t k) { return "rotor_" + std::to_string(k + 1); }

double student_95(double freedom) { return boost::math::quantile(boost::math::students_t(freedom), 0.95); }

const stability::EffectSpec* present_in(const stability::Model& model) {
  const auto found =
      std::find_if(model.effects.begin(), model.effects.end(),
                   [](const stability::EffectSpec& spec) { return spec.name == rotor_effect(); });
  return found == model.effects.end() ? nullptr : &*found;
}

/// Returns the spec for with_effects(), which is added to the model's effect or becomes a new one.
stability::EffectSpec spec_for(const stability::Model& model, const RotorFactors& factors) {
  const stability::EffectSpec* const present = present_in(model);
  const RotorFactors before = rotor_factors_of(model);
  stability::EffectSpec spec;
  spec.name = rotor_effect();
  for (std::size_t k = 0; k < kRotorCount; ++k) {
    const double off = present == nullptr ? 0 : before[k].value;
    const RotorFactor& factor = factors[k];
    spec.parameters[coefficient_of(k)] = factor.value - off;
    spec.fit.interval[coefficient_of(k)] = {factor.interval.lower - off, factor.interval.upper - off};
  }
  if (present != nullptr) {
    spec.parameters["model"] = 0;
    spec.fit.interval["model"] = {0, 0};
  }
  spec.parameters["arm_m"] = model.arm_m;
  spec.parameters["torque_per_thrust_m"] = model.torque_per_thrust_m;
  return spec;
}

}  // namespace

RotorFactors rotor_factors(const RotorLoads& flight) {
  RotorFactors factors;
  const double each_N = flight.mean_N.mean();
  for (std::size_t k = 0; k < kRotorCount; ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    const double value = each_N / flight.mean_N[i];
    // Blocks of 1 s: as many as in the minimum of three seconds per flight.
    const double half = value * student_95(2) * flight.error_N[i] / flight.mean_N[i];
    factors[k] = {value, {value - half, value + half}};
  }
  return factors;
}

RotorFactors rotor_factors(const std::vector<RotorLoads>& flights, const std::vector<double>& scale,
                           const stability::Model& model) {
  const auto count = static_cast<double>(flights.size());
  std::vector<Eigen::Vector4d> of_flight;
  Eigen::Vector4d mean = Eigen::Vector4d::Zero(), squares = Eigen::Vector4d::Zero();
  // Flights that agree exactly understate the uncertainty: each is known only to within its own standard error.
  Eigen::Vector4d within_squares = Eigen::Vector4d::Zero();
  for (std::size_t f = 0; f < flights.size(); ++f) {
    const Eigen::Vector4d& mapped_N = flights[f].mean_N;
    of_flight.emplace_back(scale[f] * mapped_N.mean() * mapped_N.cwiseInverse());
    mean += of_flight.back() / count;
    within_squares +=
        (of_flight.back().array() * flights[f].error_N.array() / mapped_N.array()).square().matrix();
  }
  for (const Eigen::Vector4d& one : of_flight) squares += (one - mean).cwiseAbs2();
  const Eigen::Vector4d within = within_squares.cwiseSqrt();
  const double battery = kBatteryPlay_m / (model.arm_m * std::sqrt(0.5));
  RotorFactors factors;
  for (std::size_t k = 0; k < kRotorCount; ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    const double value = mean[i];
    const double half = flights.size() < 2
                            ? battery * value
                            : student_95(count - 1) *
                                  std::max(std::sqrt(squares[i] / (count - 1) / count), within[i] / count);
    factors[k] = {value, {value - half, value + half}};
  }
  return factors;
}

double rotor_imbalance_N(const std::vector<RotorLoads>& flights, const RotorFactors& factors) {
  double squares = 0;
  for (const RotorLoads& flight : flights) {
    Eigen::Vector4d force_N = flight.mean_N;
    for (std::size_t k = 0; k < kRotorCount; ++k) force_N[static_cast<Eigen::Index>(k)] *= factors[k].value;
    squares += (force_N.array() - force_N.mean()).square().sum();
  }
  return flights.empty() ? 0 : std::sqrt(squares / static_cast<double>(kRotorCount * flights.size()));
}

RotorFactors rotor_factors_of(const stability::Model& model) {
  RotorFactors factors;
  const stability::EffectSpec* const present = present_in(model);
  if (present == nullptr) return factors;
  for (std::size_t k = 0; k < kRotorCount; ++k) {
    const auto found = present->parameters.find(coefficient_of(k));
    if (found == present->parameters.end()) continue;
    factors[k] = {found->second, {found->second, found->second}};
  }
  return factors;
}

std::vector<Missing> fit_rotors(const residuals::Inputs& inputs, const std::string& kind,
                                const std::vector<int>& which, int jobs) {
  residuals::Inputs some = inputs;
  some.found.flights.clear();
  for (const int i : which) some.found.flights.push_back(inputs.found.flights[static_cast<std::size_t>(i)]);
  const std::vector<RotorLoads> loads = rotor_loads(some, kind, jobs);
  if (loads.empty()) return {};
  const stability::Model& model = *inputs.model_of(kind);
  std::vector<double> scale;
  for (const RotorLoads& flight : loads)
    scale.push_back(model.weight_N() / flight.mean_N.sum() - own_thrust_ratio(model));
  const RotorFactors factors = rotor_factors(loads, scale, model);
  Missing missing;
  missing.effect = rotor_effect();
  const stability::EffectInfo& info = stability::effect_info(missing.effect);
  missing.equivalence_class = info.equivalence_class;
  missing.kind = kind;
  missing.excitation = info.excitation;
  for (std::size_t k = 0; k < kRotorCount; ++k) {
    missing.coefficients.push_back(coefficient_of(k));
    missing.parameters[coefficient_of(k)] = factors[k].value;
    missing.intervals[coefficient_of(k)] = factors[k].interval;
  }
  missing.specs = {spec_for(model, factors)};
  for (const RotorLoads& flight : loads) missing.specs[0].fit.flights.push_back(flight.flight);
  missing.finding.rmse_before_N = rotor_imbalance_N(loads, rotor_factors_of(model));
  missing.finding.rmse_after_N = rotor_imbalance_N(loads, factors);
  return {missing};
}

}  // namespace swarmcert::identification
