#include "analysis/tracking/tube/motion.h"

#include <cmath>
#include <map>

#include "analysis/tracking/tube/learned_force.h"

namespace swarmcert::analysis {
namespace {

using stability::SetpointRange;

/// Ends are moved outwards to multiples of this, so that periods which differ by rounding alone are found to be the
/// same.
constexpr double kGrid = 0x1p-24;

Interval snapped(Interval x) {
  return {std::floor(x.lower / kGrid) * kGrid, std::ceil(x.upper / kGrid) * kGrid};
}

}  // namespace

double whole_periods_s(double duration_s, double period_s, double longest_s) {
  for (double periods = std::floor(longest_s / period_s * (1 + 1e-9)); periods >= 1; --periods) {
    const double slices = duration_s / (periods * period_s);
    if (std::abs(slices - std::round(slices)) < 1e-9 && std::round(slices) >= 1) return periods * period_s;
  }
  return longest_s;
}

Motion sliced(const stability::Task& task, int vehicles, double memory_s, double longest_s, double held_s) {
  Motion motion;
  motion.vehicles = vehicles;
  motion.slices = static_cast<int>(std::ceil(task.duration_s() / longest_s - 1e-9));
  motion.slice_s = task.duration_s() / motion.slices;
  motion.stretch_of.resize(static_cast<std::size_t>(vehicles));
  std::map<std::vector<double>, int> known;
  for (int k = 0; k < motion.slices; ++k) {
    std::vector<SetpointRange> ranges, now, held;
    // A little more than the slice: k slice_s is rounded.
    const double margin_s = 1e-12 * (k + 2);
    const auto add_ranges = [&](double before_s, std::vector<SetpointRange>& to) {
      const double from_s = std::max(0.0, k * motion.slice_s - before_s - margin_s);
      for (int i = 0; i < vehicles; ++i) {
        const std::optional<SetpointRange> range = task.over(i, from_s, (k + 1) * motion.slice_s + margin_s);
        if (range) to.push_back(*range);
      }
      return to.size() == static_cast<std::size_t>(vehicles);
    };
    if (!add_ranges(memory_s, ranges) || !add_ranges(0, now) || !add_ranges(held_s, held)) return {};
    for (int i = 0; i < vehicles; ++i) {
      const SetpointRange& own = ranges[static_cast<std::size_t>(i)];
      Stretch stretch;
      stretch.vehicle = i;
      std::vector<double> key = {static_cast<double>(i)};
      const auto add = [&](Interval x) {
        stretch.state.push_back(snapped(x));
        key.push_back(stretch.state.back().lower);
        key.push_back(stretch.state.back().upper);
      };
      const auto largest = [&](Interval x) {
        key.push_back(snapped({0, x.mag()}).upper);
        return key.back();
      };
      for (int j = 0; j < vehicles; ++j) {
        if (j == i) continue;
        const SetpointRange& other = ranges[static_cast<std::size_t>(j)];
        for (int a = 0; a < 3; ++a) add(other.p_W_m[a] - own.p_W_m[a]);
        for (int a = 0; a < 3; ++a) add(other.v_W_m_s[a] - own.v_W_m_s[a]);
        Interval squares;
        for (int a = 0; a < 3; ++a) {
          const Interval size = abs(other.a_W_m_s2[a] - own.a_W_m_s2[a]);
          squares += size * size;
        }
        stretch.relative_acceleration_m_s2.push_back(largest(sqrt(squares)));
      }
      add(own.p_W_m[2]);
      for (int a = 0; a < 3; ++a) add(own.v_W_m_s[a]);
      for (int a = 0; a < 3; ++a) {
        const auto kept = [&key](Interval x) {
          const Interval outer = snapped(x);
          key.push_back(outer.lower);
          key.push_back(outer.upper);
          return outer;
        };
        const auto at = static_cast<std::size_t>(i);
        stretch.acceleration_m_s2[a] = kept(own.a_W_m_s2[a]);
        stretch.acceleration_now_m_s2[a] = kept(now[at].a_W_m_s2[a]);
        stretch.jerk_m_s3[a] = kept(held[at].jerk_W_m_s3[a]);
      }
      const auto [found, is_new] = known.emplace(std::move(key), static_cast<int>(motion.stretches.size()));
      if (is_new) motion.stretches.push_back(std::move(stretch));
      motion.stretch_of[static_cast<std::size_t>(i)].push_back(found->second);
    }
  }
  return motion;
}

}  // namespace swarmcert::analysis
