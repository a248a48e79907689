#include "analysis/residuals/plausibility.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

namespace swarmcert::residuals {
namespace {

constexpr double kBefore_s = 0.1, kAfter_s = 0.3;

/// Returns the largest possible specific force in flight, in m/s^2.
double largest_specific_force(const stability::Model& model, double battery_V) {
  constexpr double kMargin = 1.25, kLeast_m_s2 = 2 * stability::kGravity_m_s2;
  return std::max(kMargin * model.largest_thrust_N(battery_V) / model.mass_kg, kLeast_m_s2);
}

bool leaps(const stability::Model& model, const Track& track, std::size_t i) {
  constexpr double kAside_m = 0.25, kTimes = 3;
  const stability::Instant& now = track.instants[i];
  const double limit_m_s2 = largest_specific_force(model, now.battery_V);
  if (track.specific_force_m_s2[i].norm() > limit_m_s2) return true;
  if (i == 0 || track.restarts[i] != 0) return false;
  const stability::Instant& before = track.instants[i - 1];
  const double step_s = now.time_s - before.time_s;
  const Eigen::Vector3d led_m = 0.5 * step_s * (now.v_W_m_s + before.v_W_m_s);
  return (now.p_W_m - before.p_W_m - led_m).norm() > kAside_m ||
         (now.v_W_m_s - before.v_W_m_s).norm() > kTimes * limit_m_s2 * std::max(step_s, 0.01);
}

}  // namespace

std::vector<logs::Doubt> doubts_of(const stability::Model& model, const Track& track) {
  constexpr double kLeastThrust = 0.75, kLargestThrust = 1.3;
  double sum_N = 0, sum_V = 0, count = 0;
  for (std::size_t i = 0; i < track.instants.size(); ++i) {
    if (track.cut[i] != Cut::kNone) continue;
    const stability::Instant& now = track.instants[i];
    sum_N += now.thrust_N * now.b3_W().z();
    sum_V += now.battery_V;
    count += 1;
  }
  std::vector<logs::Doubt> doubts;
  if (count == 0) return doubts;
  const std::string battery = stability::battery_problem(model, sum_V / count);
  if (!battery.empty()) doubts.push_back({"battery", sum_V / count, "battery: " + battery, false});
  const double ratio = sum_N / count / model.weight_N();
  if (ratio >= kLeastThrust && ratio <= kLargestThrust) return doubts;
  doubts.push_back(
      {"thrust", ratio,
       fmt::format("thrust: the model gives {:.3g} times the weight on average, but flight needs 1; mass_kg, "
                   "the thrust polynomial, duty or battery is wrong, or a payload is flown",
                   ratio),
       false});
  return doubts;
}

void cut_impacts(const stability::Model& model, const CutRules& rules, Track& track) {
  if (rules.published || rules.keep_impacts) return;
  const std::size_t n = track.instants.size();
  std::size_t from = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (!leaps(model, track, i)) continue;
    const double time_s = track.instants[i].time_s;
    while (track.instants[from].time_s < time_s - kBefore_s) ++from;
    for (std::size_t k = from; k < n && track.instants[k].time_s <= time_s + kAfter_s; ++k) {
      if (track.cut[k] == Cut::kNone) track.cut[k] = Cut::kImpact;
    }
  }
  track.used = static_cast<std::size_t>(std::count(track.cut.begin(), track.cut.end(), Cut::kNone));
}

}  // namespace swarmcert::residuals
