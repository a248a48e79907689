#include "analysis/logs/hover_scale.h"

#include <cmath>

#include "analysis/logs/statistics_of_series.h"

namespace swarmcert::logs {
namespace {

struct Candidate {
  std::vector<double> thrust;
  double hover = 0, scatter = INFINITY;
};

Candidate scaled(const Log& log, std::vector<double> thrust) {
  Candidate candidate;
  const double high = quantile_of(thrust, 0.9);
  std::vector<double> ratios;
  for (std::size_t i = 0; i < thrust.size(); ++i) {
    const auto R = log.samples[i].attitude.rotation();
    const double load = log.samples[i].specific_force_m_s2[2] / kGravity_m_s2 / std::max(R[2][2], 0.1);
    if (thrust[i] > high / 3 && load > 0.5 && load < 2) ratios.push_back(thrust[i] / load);
  }
  candidate.thrust = std::move(thrust);
  if (ratios.empty()) return candidate;
  candidate.hover = median(ratios);
  for (double& ratio : ratios) ratio = std::abs(ratio / candidate.hover - 1);
  candidate.scatter = median(ratios);
  return candidate;
}

}  // namespace

void use_hover_multiples(Log& log) {
  Signals& signals = log.signals;
  if (signals.thrust != ThrustSource::kDuty && signals.thrust != ThrustSource::kForce) return;
  Candidate best;
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
    Candidate candidate = scaled(log, std::move(thrust));
    if (candidate.scatter < best.scatter) best = std::move(candidate);
    if (signals.thrust == ThrustSource::kForce) break;
  }
  if (!(best.hover > 0)) return;
  for (std::size_t i = 0; i < log.samples.size(); ++i)
    log.samples[i].given_thrust = best.thrust[i] / best.hover;
  signals.thrust = ThrustSource::kHoverMultiple;
}

}  // namespace swarmcert::logs
