#include <algorithm>
#include <cmath>

#include "stability/simulation/swarm_kind.h"

namespace swarmcert::stability {
namespace {

/// Upper bound on the rate of change of a vehicle's velocity; determines how long a list of neighbours stays valid.
constexpr double kFastestChange_m_s2 = 50;

}  // namespace

void Swarm::find_neighbours(const double* rows, double horizon_s) {
  const bool were_listed = listed_;
  listed_ = interacts_;
  if (!interacts_) return;
  const auto at = [rows](int i) { return rows + row_index(i, kVehicleStateSize); };
  double fastest2 = 0;
  for (int i = 0; i < size(); ++i) {
    const double* const v = at(i) + kVelocity * kRowLength;
    const double x = v[0], y = v[kRowLength], z = v[2 * kRowLength];
    fastest2 = std::max(fastest2, x * x + y * y + z * z);
  }
  const double margin_m = 2 * horizon_s * (std::sqrt(fastest2) + horizon_s * kFastestChange_m_s2);
  bool same = were_listed;
  for (int i = 0; i < size(); ++i) {
    const double* const x = at(i);
    const Kind& own = kind(i);
    std::vector<int>& near = near_[static_cast<std::size_t>(i)];
    found_.clear();
    for (int j = 0; j < size(); ++j) {
      if (j == i) continue;
      const double* const y = at(j);
      const double dx = y[0] - x[0], dy = y[kRowLength] - x[kRowLength];
      const double dz = y[2 * kRowLength] - x[2 * kRowLength];
      const double distance2 = dx * dx + dy * dy;
      const double reach = own.reach_m.over(dz - margin_m, dz + margin_m);
      if (reach > 0 && distance2 < (reach + margin_m) * (reach + margin_m)) found_.push_back(j);
    }
    if (found_ == near) continue;
    same = false;
    near.swap(found_);
  }
  pairs_hold_ = pairs_hold_ && same;
  find_meetings(rows, horizon_s);
}

void Swarm::find_meetings(const double* rows, double horizon_s) {
  meetings_.clear();
  for (int i = 0; i < size(); ++i) {
    const double* const own = rows + row_index(i, kVehicleStateSize);
    for (const int j : near_[static_cast<std::size_t>(i)]) {
      const double* const other = rows + row_index(j, kVehicleStateSize);
      const auto apart = [own, other](int c) { return other[c * kRowLength] - own[c * kRowLength]; };
      const double margin_m = horizon_s * (std::abs(apart(kVelocity + 2)) + horizon_s * kFastestChange_m_s2);
      for (const double bend_m : kind(i).bends_m) {
        if (std::abs(apart(kPosition + 2) - bend_m) <= margin_m) meetings_.push_back({i, j, bend_m});
      }
    }
  }
}

double Swarm::first_bend(const double* before, const double* after, double step_s) const {
  // Crossings closer than this to an end of the step cause only a small error.
  constexpr double kAtEnd = 1e-3;
  double first = 1;
  for (const Meeting& meeting : meetings_) {
    const std::size_t own = row_index(meeting.lower, kVehicleStateSize);
    const std::size_t other = row_index(meeting.upper, kVehicleStateSize);
    const auto apart = [own, other](const double* rows, int c) {
      return rows[other + static_cast<std::size_t>(c * kRowLength)] -
             rows[own + static_cast<std::size_t>(c * kRowLength)];
    };
    const double from = apart(before, kPosition + 2) - meeting.bend_m;
    const double to = apart(after, kPosition + 2) - meeting.bend_m;
    if ((from < 0) == (to < 0)) continue;
    // Zero of the cubic through both heights and velocities, by bisection, to within 1e-12 of the step.
    const double v_from = step_s * apart(before, kVelocity + 2), v_to = step_s * apart(after, kVelocity + 2);
    double low = 0, high = 1;
    for (int k = 0; k < 40; ++k) {
      const double u = (low + high) / 2, w = 1 - u;
      const double height = w * w * ((1 + 2 * u) * from + u * v_from) + u * u * ((1 + 2 * w) * to - w * v_to);
      ((height < 0) == (from < 0) ? low : high) = u;
    }
    if (low > kAtEnd && low < 1 - kAtEnd) first = std::min(first, low);
  }
  return first;
}

void Swarm::copy_unreached(const double* from, double* rows) const {
  for (int i = 0; i < size(); ++i) {
    if (!near_[static_cast<std::size_t>(i)].empty()) continue;
    const std::size_t at = row_index(i, kVehicleStateSize);
    for (std::size_t c = 0; c < kVehicleStateSize; ++c) rows[at + c * kRowLength] = from[at + c * kRowLength];
    const auto own = static_cast<std::size_t>(i);
    if (!has_effect_states(i)) continue;
    const std::size_t first = state_uses_[first_use_[own]].first;
    const StateUse& last = state_uses_[first_use_[own + 1] - 1];
    const std::size_t end = last.first + static_cast<std::size_t>(last.effect->num_states());
    std::copy(effect_states(from) + first, effect_states(from) + end, effect_states(rows) + first);
  }
}

void Swarm::forget_neighbours() {
  listed_ = pairs_hold_ = false;
  meetings_.clear();
}

}  // namespace swarmcert::stability
