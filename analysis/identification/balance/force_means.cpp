#include "analysis/identification/balance/force_means.h"

namespace swarmcert::identification {

std::vector<ForceMean> specific_force_means(const residuals::Track& track, double length_s) {
  std::vector<ForceMean> all;
  Eigen::Vector3d integral_m_s = Eigen::Vector3d::Zero();
  std::size_t first = 0;
  bool is_open = false;
  for (std::size_t i = 0; i < track.instants.size(); ++i) {
    if (track.cut[i] != residuals::Cut::kNone || track.restarts[i] != 0) {
      is_open = false;
      continue;
    }
    if (!is_open) {
      first = i;
      integral_m_s.setZero();
      is_open = true;
      continue;
    }
    const double now_s = track.instants[i].time_s, long_s = now_s - track.instants[first].time_s;
    integral_m_s += (now_s - track.instants[i - 1].time_s) / 2 *
                    (track.specific_force_m_s2[i - 1] + track.specific_force_m_s2[i]);
    if (long_s < length_s) continue;
    all.push_back({first, i, integral_m_s / long_s});
    first = i;
    integral_m_s.setZero();
  }
  return all;
}

}  // namespace swarmcert::identification
