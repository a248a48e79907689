#include "analysis/identification/turning_search.h"

#include <algorithm>
#include <numeric>

namespace swarmcert::identification {
namespace {

constexpr double kLeastFallOfRates = 0.05;
constexpr double kLeastShareOfMotion = 0.02;

double mean_over_tracks(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

}  // namespace

TurningSearch::TurningSearch(const residuals::Inputs& inputs, const std::string& kind,
                             const std::vector<int>& fit, const std::vector<int>& select, int jobs)
    : fit_(inputs, kind, fit, jobs), select_(inputs, kind, select, jobs) {
  if (is_possible()) accepted_.rates = select_.rate_errors({});
}

double Turned::mean_rad_s() const {
  std::vector<double> norms;
  for (const RateErrors& track : rates) norms.push_back(track.norm_rad_s());
  return mean_over_tracks(norms);
}

Turned TurningSearch::with(const std::string& name) const {
  std::vector<stability::EffectSpec> specs = accepted_.specs;
  specs.push_back(turning_effect(name));
  specs = fit_.fitted(specs);
  return {name, specs, select_.rate_errors(specs)};
}

double TurningSearch::error_ratio(const Turned& next, std::size_t axis) const {
  std::vector<double> ratios;
  for (std::size_t k = 0; k < next.rates.size(); ++k)
    ratios.push_back(next.rates[k].rad_s[axis] / accepted_.rates[k].rad_s[axis]);
  return mean_over_tracks(ratios);
}

bool TurningSearch::explains_motion(const Turned& next) const {
  const std::vector<RateErrors> held = select_.held();
  if (error_ratio(next) > 1) return false;
  for (std::size_t axis = 0; axis <= kNorm; ++axis) {
    std::vector<double> shares;
    for (std::size_t k = 0; k < held.size(); ++k) {
      const double before = accepted_.rates[k].rad_s[axis] / held[k].rad_s[axis];
      const double after = next.rates[k].rad_s[axis] / held[k].rad_s[axis];
      shares.push_back(before * before - after * after);
    }
    const bool falls = error_ratio(next, axis) <= 1 - kLeastFallOfRates;
    if (falls && mean_over_tracks(shares) >= kLeastShareOfMotion) return true;
  }
  return false;
}

std::optional<Turned> TurningSearch::best_of(const std::vector<std::string>& names) const {
  std::optional<Turned> best;
  for (const std::string& name : names) {
    Turned next = with(name);
    if (explains_motion(next) && (!best || next.mean_rad_s() < best->mean_rad_s())) best = std::move(next);
  }
  return best;
}

std::vector<TurningStep> turning_steps(const residuals::Inputs& inputs, const std::string& kind,
                                       const std::vector<int>& fit, const std::vector<int>& select,
                                       int jobs) {
  std::vector<TurningStep> steps;
  TurningSearch search(inputs, kind, fit, select, jobs);
  if (!search.is_possible()) return steps;
  std::vector<std::string> left = turning_effects();
  while (const std::optional<Turned> next = search.best_of(left)) {
    steps.push_back({*next, search.accepted().mean_rad_s()});
    search.accept(*next);
    left.erase(std::find(left.begin(), left.end(), next->name));
  }
  return steps;
}

}  // namespace swarmcert::identification
