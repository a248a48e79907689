#include "analysis/logs/hover_scale.h"

#include <cmath>

#include "analysis/logs/statistics_of_series.h"

namespace swarmcert::logs {
HoverScale hover_scale(const std::vector<double>& thrust, const std::vector<double>& load) {
  constexpr std::size_t kFew = 10;
  // The rotors carry the vehicle where their thrust is above a third of its upper quantile.
  const double high = quantile_of(thrust, 0.9);
  std::vector<double> ratios;
  for (std::size_t i = 0; i < thrust.size(); ++i)
    if (thrust[i] > high / 3 && load[i] > 0.5 && load[i] < 2) ratios.push_back(thrust[i] / load[i]);
  if (ratios.size() < kFew) return {quantile_of(thrust, 0.5), 0};
  HoverScale scale;
  scale.hover = median(ratios);
  for (double& ratio : ratios) ratio = std::abs(ratio / scale.hover - 1);
  scale.scatter = median(ratios) / 0.6745;  // median absolute value of a standard normal variable
  return scale;
}

void use_hover_multiples(Log& log) {
  Signals& signals = log.signals;
  if (signals.thrust != ThrustSource::kDuty && signals.thrust != ThrustSource::kForce) return;
  std::vector<double> load;
  for (const Sample& sample : log.samples)
    load.push_back(sample.specific_force_m_s2[2] / kGravity_m_s2 /
                   std::max(sample.attitude.rotation()[2][2], 0.1));
  std::vector<double> best;
  HoverScale of_best{0, INFINITY};
  for (const double power : {1.0, 1.5, 2.0}) {
    std::vector<double> thrust;
    for (const Sample& sample : log.samples) {
      double sum = sample.given_thrust;
      if (signals.thrust == ThrustSource::kDuty) {
        sum = 0;
        for (const double duty : sample.duty) sum += std::pow(std::max(duty, 0.0) * sample.battery_V, power);
      }
      thrust.push_back(sum);
    }
    const HoverScale scale = hover_scale(thrust, load);
    if (scale.scatter < of_best.scatter) {
      of_best = scale;
      best = std::move(thrust);
    }
    if (signals.thrust == ThrustSource::kForce) break;
  }
  if (!(of_best.hover > 0)) return;
  for (std::size_t i = 0; i < log.samples.size(); ++i) log.samples[i].given_thrust = best[i] / of_best.hover;
  signals.thrust = ThrustSource::kHoverMultiple;
}

}  // namespace swarmcert::logs
