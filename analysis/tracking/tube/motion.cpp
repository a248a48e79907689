#include "analysis/tracking/tube/motion.h"

#include <cmath>
#include <map>

#include "analysis/tracking/tube/learned_force.h"

namespace swarmcert::analysis {
namespace {

using stability::SetpointRange;

/// Interval ends are rounded outward to multiples of this, so that periods that differ only by rounding are
/// recognised as equal.
constexpr double kGrid = 0x1p-24;

Interval snapped(Interval x) {
  return {std::floor(x.lower / kGrid) * kGrid, std::ceil(x.upper / kGrid) * kGrid};
}

/// Setpoint ranges of all vehicles: in a slice and the `memory_s` before it, in the slice alone, and in it and the
/// `held_s` before it.
struct SliceRanges {
  std::vector<SetpointRange> ranges, now, held;
  bool complete = false;  ///< the task has an enclosure for all of them
};

SliceRanges ranges_of(const stability::Task& task, int vehicles, int slice, double slice_s, double memory_s,
                      double held_s) {
  SliceRanges result;
  // Slightly more than the slice, because slice * slice_s is rounded.
  const double margin_s = 1e-12 * (slice + 2);
  const auto add_ranges = [&](double before_s, std::vector<SetpointRange>& to) {
    const double from_s = std::max(0.0, slice * slice_s - before_s - margin_s);
    for (int i = 0; i < vehicles; ++i) {
      const std::optional<SetpointRange> range = task.over(i, from_s, (slice + 1) * slice_s + margin_s);
      if (range) to.push_back(*range);
    }
    return to.size() == static_cast<std::size_t>(vehicles);
  };
  result.complete =
      add_ranges(memory_s, result.ranges) && add_ranges(0, result.now) && add_ranges(held_s, result.held);
  return result;
}

/// A stretch with its numbers as a key: stretches with equal numbers are identical.
struct KeyedStretch {
  Stretch stretch;
  std::vector<double> key;

  Interval kept(Interval x) {
    const Interval outer = snapped(x);
    key.push_back(outer.lower);
    key.push_back(outer.upper);
    return outer;
  }

  /// Appends the motion of vehicle `other` relative to `own`.
  void add_neighbour(const SetpointRange& own, const SetpointRange& other) {
    for (int a = 0; a < 3; ++a) stretch.state.push_back(kept(other.p_W_m[a] - own.p_W_m[a]));
    for (int a = 0; a < 3; ++a) stretch.state.push_back(kept(other.v_W_m_s[a] - own.v_W_m_s[a]));
  }
};

/// Returns the stretch of vehicle `i` in a slice.
KeyedStretch stretch_in(const SliceRanges& slice, int i) {
  const auto at = static_cast<std::size_t>(i);
  const SetpointRange& own = slice.ranges[at];
  KeyedStretch result;
  Stretch& stretch = result.stretch;
  stretch.vehicle = i;
  result.key = {static_cast<double>(i)};
  for (std::size_t j = 0; j < slice.ranges.size(); ++j)
    if (j != at) result.add_neighbour(own, slice.ranges[j]);
  stretch.state.push_back(result.kept(own.p_W_m[2]));
  for (int a = 0; a < 3; ++a) stretch.state.push_back(result.kept(own.v_W_m_s[a]));
  for (int a = 0; a < 3; ++a) {
    stretch.acceleration_m_s2[a] = result.kept(own.a_W_m_s2[a]);
    stretch.acceleration_now_m_s2[a] = result.kept(slice.now[at].a_W_m_s2[a]);
    stretch.jerk_m_s3[a] = result.kept(slice.held[at].jerk_W_m_s3[a]);
  }
  return result;
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
    const SliceRanges ranges = ranges_of(task, vehicles, k, motion.slice_s, memory_s, held_s);
    if (!ranges.complete) return {};
    for (int i = 0; i < vehicles; ++i) {
      KeyedStretch next = stretch_in(ranges, i);
      const auto [found, is_new] =
          known.emplace(std::move(next.key), static_cast<int>(motion.stretches.size()));
      if (is_new) motion.stretches.push_back(std::move(next.stretch));
      motion.stretch_of[static_cast<std::size_t>(i)].push_back(found->second);
    }
  }
  return motion;
}

}  // namespace swarmcert::analysis
