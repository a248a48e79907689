#include "analysis/identification/turning_search.h"

#include <numeric>

#include "analysis/identification/selection.h"

namespace swarmcert::identification {
namespace {

constexpr double kLeastFallOfRates = 0.05;

double mean_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

}  // namespace

TurningSearch::TurningSearch(const residuals::Inputs& inputs, const std::string& kind,
                             const std::vector<int>& fit, const std::vector<int>& select, int jobs)
    : fit_(inputs, kind, fit, jobs), select_(inputs, kind, select, jobs) {
  if (is_possible()) accepted_.rates_rad_s = select_.rate_errors_rad_s({});
}

double Turned::mean_rad_s() const { return mean_of(rates_rad_s); }

Turned TurningSearch::with(const std::string& name) const {
  std::vector<stability::EffectSpec> specs = accepted_.specs;
  specs.push_back(turning_effect(name));
  specs = fit_.fitted(specs);
  return {name, specs, select_.rate_errors_rad_s(specs)};
}

double TurningSearch::error_ratio(const Turned& next) const {
  std::vector<double> ratios;
  for (std::size_t k = 0; k < next.rates_rad_s.size(); ++k)
    ratios.push_back(next.rates_rad_s[k] / accepted_.rates_rad_s[k]);
  return mean_of(ratios);
}

bool TurningSearch::explains_motion(const Turned& next) const {
  const std::vector<double> held_rad_s = select_.held_rad_s();
  std::vector<double> shares;
  for (std::size_t k = 0; k < held_rad_s.size(); ++k) {
    const double before = accepted_.rates_rad_s[k] / held_rad_s[k],
                 after = next.rates_rad_s[k] / held_rad_s[k];
    shares.push_back(before * before - after * after);
  }
  return error_ratio(next) <= 1 - kLeastFallOfRates && mean_of(shares) >= Thresholds{}.gain;
}

std::optional<Turned> TurningSearch::best_of(const std::vector<std::string>& names) const {
  std::optional<Turned> best;
  for (const std::string& name : names) {
    Turned next = with(name);
    if (!best || next.mean_rad_s() < best->mean_rad_s()) best = std::move(next);
  }
  if (best && !explains_motion(*best)) best.reset();
  return best;
}

}  // namespace swarmcert::identification
