#include <cmath>

#include "analysis/logs/interpretation.h"
#include "analysis/logs/statistics_of_series.h"

namespace swarmcert::logs {
namespace {

constexpr double kLongest_s = 0.15, kBelievedDelay = 0.5;

/// Returns the correlation of a(t) with b(t + lag records).
double correlation_at(const SignalTable& t, double step_s, const std::vector<double>& a,
                      const std::vector<double>& b, int lag) {
  std::vector<double> x, y;
  const auto n = static_cast<int>(t.size());
  for (int i = std::max(0, -lag); i < n - std::max(0, lag); ++i) {
    const auto at = static_cast<std::size_t>(i), other = static_cast<std::size_t>(i + lag);
    const double apart_s = 1e-6 * (t.time_us[other] - t.time_us[at]);
    if (std::abs(apart_s - lag * step_s) > step_s) continue;  // there is a gap in between
    x.push_back(a[at]);
    y.push_back(b[other]);
  }
  return correlation_of(x, y);
}

/// Returns the changes over 60 ms, which suppresses slow drifts.
std::vector<double> changes(const SignalTable& t, const std::vector<double>& series) {
  const double step_s = t.step_s();
  const auto half = static_cast<std::size_t>(std::max(1.0, std::round(0.03 / step_s)));
  std::vector<double> change(series.size(), std::nan(""));
  for (std::size_t i = half; i + half < series.size(); ++i) {
    if (t.time_us[i + half] - t.time_us[i - half] < 2.5e6 * static_cast<double>(half) * step_s)
      change[i] = series[i + half] - series[i - half];
  }
  return change;
}

}  // namespace

void estimate_delays(Draft& draft) {
  const SignalTable& t = draft.table;
  const double step_s = t.step_s();
  if (!(step_s > 0) || t.size() < 200 || !t.has(kForceWorld)) return;
  const auto add = [&](const std::string& signal, const std::vector<double>& late, const std::string& against,
                       const std::vector<double>& early) {
    const std::vector<double> a = changes(t, early), b = changes(t, late);
    const int most = static_cast<int>(std::floor(kLongest_s / step_s));
    int best = 0;
    double highest = -1;
    std::vector<double> all;
    for (int lag = -most; lag <= most; ++lag) {
      all.push_back(correlation_at(t, step_s, a, b, lag));
      if (all.back() > highest) {
        highest = all.back();
        best = lag;
      }
    }
    if (highest < kBelievedDelay || best == -most || best == most) return;
    // Vertex of the parabola through the maximum and its two neighbours.
    const auto at = static_cast<std::size_t>(best + most);
    const double left = all[at - 1], right = all[at + 1], curvature = left - 2 * highest + right;
    const double shift = curvature < 0 ? 0.5 * (left - right) / curvature : 0;
    draft.log.delays.push_back({signal, against, (best + shift) * step_s, highest});
  };
  const auto& vertical = draft.acceleration_m_s2[2];
  if (draft.log.signals.specific_force == ForceSource::kAccelerometer && !vertical.empty())
    add("specific_force", t[kForceWorld + 2], "acceleration", vertical);
  if (draft.log.signals.thrust == ThrustSource::kNone) return;
  std::vector<double> thrust(t.size(), 0);
  for (std::size_t i = 0; i < t.size(); ++i) {
    if (draft.log.signals.thrust != ThrustSource::kDuty)
      thrust[i] = t[kThrust][i];
    else
      for (int k = 0; k < 4; ++k) thrust[i] += t[kDuty + k][i] * t[kBattery][i];
  }
  add("specific_force", t[kForceWorld + 2], "thrust", thrust);
}

}  // namespace swarmcert::logs
