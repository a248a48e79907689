#include "analysis/tracking/tube/sliced_tube.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "analysis/tracking/tube/axis_in_slices.h"
#include "nn/base/parallel.h"

namespace swarmcert::analysis {

namespace {

constexpr int kMostTries = 12;
/// Relative and absolute (m or m/s) widening of the last result for the next trial.
constexpr double kWiderBy = 0.02, kWiderBy_m = 1e-6;

Interval wider(Interval x) {
  const double more = kWiderBy * (x.upper - x.lower) + kWiderBy_m;
  return {x.lower - more, x.upper + more};
}

bool inside(Interval inner, Interval outer) { return inner.lower > outer.lower && inner.upper < outer.upper; }

template <class Change>
Deviations each(const Deviations& a, const Deviations& b, const Change& change) {
  Deviations result = a;
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      result[i].position_m[k] = change(a[i].position_m[k], b[i].position_m[k]);
      result[i].velocity_m_s[k] = change(a[i].velocity_m_s[k], b[i].velocity_m_s[k]);
    }
  }
  return result;
}

/// Deviations by the part of the lag interval in which the vehicle's own lag lies.
using ByPart = std::vector<Deviations>;

template <class Change>
ByPart each(const ByPart& a, const ByPart& b, const Change& change) {
  ByPart result;
  for (std::size_t p = 0; p < a.size(); ++p) result.push_back(each(a[p], b[p], change));
  return result;
}

/// Of deviations, or of all parts.
template <class Any>
bool every_inside(const Any& inner, const Any& outer) {
  bool result = true;
  each(inner, outer, [&result](Interval a, Interval b) {
    result = result && inside(a, b);
    return a;
  });
  return result;
}

template <class Any>
Any hull_of(const Any& a, const Any& b) {
  return each(a, b, [](Interval x, Interval y) { return hull(x, y); });
}

/// The hull over all parts, valid for any lag of each vehicle.
Deviations united(const ByPart& parts) {
  Deviations result = parts.front();
  for (const Deviations& part : parts) result = hull_of(result, part);
  return result;
}

class Sweep {
 public:
  Sweep(const Scene& scene, const EnclosureOptions& options, double tolerance_N)
      : scene_(scene), options_(options), tolerance_N_(tolerance_N), axes_(scene.lag_parts().size()) {
    for (std::size_t p = 0; p < axes_.size(); ++p) {
      const LagPart& part = scene.lag_parts()[p];
      axes_[p].resize(static_cast<std::size_t>(scene.vehicles()));
      for (int i = 0; i < scene.vehicles(); ++i) {
        std::array<AxisInSlices, 3>& axes = axes_[p][static_cast<std::size_t>(i)];
        for (std::size_t k = 0; k < 3; ++k) {
          axes[k].loop = &part.loops.axis[k];
          axes[k].estimates = &scene.estimate_answer(k);
        }
        if (!part.loops.axis[2].has_lag) continue;
        axes[2].start = &part.start_z;
        axes[2].excess_N = scene.excess_at_start_N(i);
      }
    }
    // If slices are whole periods, only their boundaries are affected by rounding.
    const ErrorLoop& loop = scene.loops().axis[0];
    if (loop.period_s > 0)
      held_ = loop.has_whole_periods
                  ? 1
                  : static_cast<int>(std::ceil(loop.period_s / scene.motion().slice_s * (1 + 1e-9)));
    remembered_ = static_cast<int>(std::ceil(scene.network_age_s() / scene.motion().slice_s + 1e-9));
  }

  /// @returns false if no tube was found for the next slice, or if cancelled.
  bool advance(SlicedTube& tube, double farthest_m) {
    const auto n = static_cast<int>(tube.slices.size());
    for (auto& of_part : axes_)
      for (auto& of_vehicle : of_part)
        for (AxisInSlices& axis : of_vehicle) axis.begin_slice();
    // The first trial assumes that the signals do not change.
    Signals signals = last_;
    if (n == 0) signals.assign(axes_.size(), std::vector<Signal>(axes_.front().size()));
    ByPart tried;
    for (int i = 0; i < kMostTries; ++i) {
      const ByPart answered = answers(signals);
      if (i > 0 && every_inside(answered, tried)) {
        keep(signals, answered, tube);
        return true;
      }
      const ByPart next = each(answered, answered, [](Interval x, Interval) { return wider(x); });
      tried = i == 0 ? next : hull_of(tried, next);
      if (!(largest_position_m(united(tried)) <= farthest_m)) {
        tube.why =
            fmt::format("at {:.3g} s errors could exceed {:g} m", n * scene_.motion().slice_s, farthest_m);
        return false;
      }
      const ByPart seen = with_past(tried, remembered_), recent = with_past(tried, held_);
      files::parallel_for(scene_.vehicles(), options_.jobs,
                          [&](int v) { set_signals(v, n, seen, recent, signals); });
      if (options_.cancelled != nullptr && *options_.cancelled) return false;
    }
    tube.why = fmt::format("no tube was found that holds at {:.3g} s", n * scene_.motion().slice_s);
    return false;
  }

 private:
  struct Signal {
    Interval difference_N;  ///< f_hat - f_a
    Forces_N truth_N;
    Interval lagging_N[3];
    LoopHistory met[3];  ///< up to the end of the slice
    HeldAnswer held[3];  ///< 0 where the loop is continuous
  };
  using Signals = std::vector<std::vector<Signal>>;  ///< [part][vehicle]

  /// Includes the deviations of the last `slices` slices.
  ByPart with_past(ByPart now, int slices) const {
    const auto count = std::min(past_.size(), static_cast<std::size_t>(slices));
    for (std::size_t back = 1; back <= count; ++back) now = hull_of(now, past_[past_.size() - back]);
    return now;
  }

  /// Sets the signals of one vehicle for every part in which its lag may lie; the lags of its neighbours may lie
  /// anywhere.
  /// @param seen deviations on which a prediction acting in the slice may be based.
  /// @param recent deviations on which a command acting in the slice may be based.
  void set_signals(int vehicle, int slice, const ByPart& seen, const ByPart& recent, Signals& signals) const {
    const Motion& motion = scene_.motion();
    const int s = motion.stretch_of[static_cast<std::size_t>(vehicle)][static_cast<std::size_t>(slice)];
    const Stretch& stretch = motion.stretches[static_cast<std::size_t>(s)];
    const auto i = static_cast<std::size_t>(vehicle);
    Deviations deviations = united(seen);
    ForceDifference difference(scene_, stretch, deviations);
    difference.refine(options_.boxes, tolerance_N_, options_.cancelled);
    for (std::size_t p = 0; p < seen.size(); ++p) {
      deviations[i] = seen[p][i];
      Signal& signal = signals[p][i];
      signal.difference_N = difference.over(deviations);
      signal.truth_N = scene_.true_force_N(stretch, deviations);
      set_loop_signals(stretch, slice, axes_[p][i], deviations[i], recent[p][i], signal);
    }
  }

  /// Derives the signals of the loop for each axis.
  void set_loop_signals(const Stretch& stretch, int slice, const std::array<AxisInSlices, 3>& axes,
                        const Deviation& seen, const Deviation& recent, Signal& signal) const {
    const Interval mass_kg(scene_.tracking().plant.mass_kg);
    for (std::size_t k = 0; k < 3; ++k) {
      signal.lagging_N[k] = signal.truth_N[k] - mass_kg * stretch.acceleration_now_m_s2[k];
      signal.met[k] = axes[k].met;
      signal.met[k].add(scene_.in_slice(slice, seen.position_m[k].mag(), seen.velocity_m_s[k].mag()));
      if (scene_.loops().is_sampled()) {
        signal.held[k] = axes[k].held(known_force(signal, k), signal.lagging_N[k], recent.velocity_m_s[k],
                                      stretch.jerk_m_s3[k], signal.met[k], static_cast<std::size_t>(held_));
      }
    }
  }

  static Interval known_force(const Signal& signal, std::size_t axis) {
    return axis == 2 ? -signal.difference_N : signal.truth_N[axis];
  }

  Interval force(const Signal& signal, std::size_t axis) const {
    const Interval known = known_force(signal, axis);
    return scene_.loops().is_sampled() ? known + signal.held[axis].mean_N : known;
  }

  ByPart answers(const Signals& signals) const {
    ByPart result(signals.size(), Deviations(signals.front().size()));
    for (std::size_t p = 0; p < signals.size(); ++p) {
      for (std::size_t i = 0; i < signals[p].size(); ++i) {
        const Signal& signal = signals[p][i];
        for (std::size_t k = 0; k < 3; ++k) {
          axes_[p][i][k].answer(force(signal, k), signal.lagging_N[k], signal.held[k].sawtooth_N_s,
                                result[p][i].position_m[k], result[p][i].velocity_m_s[k]);
        }
      }
    }
    return result;
  }

  void keep(const Signals& signals, const ByPart& answered, SlicedTube& tube) {
    for (std::size_t i = 0; i < signals.front().size(); ++i) {
      Signal all = signals.front()[i];
      double hold_N[3] = {0, 0, 0};
      for (std::size_t p = 0; p < signals.size(); ++p) {
        const Signal& signal = signals[p][i];
        for (std::size_t k = 0; k < 3; ++k) {
          keep_signals(signal, k, axes_[p][i][k]);
          hold_N[k] = std::max(hold_N[k], signal.held[k].hold_N.mag());
        }
        all.difference_N = hull(all.difference_N, signal.difference_N);
        for (std::size_t k = 0; k < 3; ++k) all.truth_N[k] = hull(all.truth_N[k], signal.truth_N[k]);
      }
      for (std::size_t k = 0; k < 3; ++k) tube.hold_N[i][k].push_back(hold_N[k]);
      tube.force_error_N[i].push_back(all.difference_N);
      tube.truth[i].push_back(all.truth_N);
    }
    tube.slices.push_back(united(answered));
    past_.push_back(answered);
    last_ = signals;
  }

  void keep_signals(const Signal& signal, std::size_t k, AxisInSlices& axis) const {
    const HeldAnswer& held = signal.held[k];
    axis.force.push_back(force(signal, k));
    axis.whole_force.push_back(known_force(signal, k) + held.hold_N);
    axis.sawtooth.emplace_back(-held.sawtooth_N_s, held.sawtooth_N_s);
    axis.lagging.push_back(signal.lagging_N[k]);
    axis.met = signal.met[k];
    axis.acceleration.push_back(held.acceleration_m_s2);
  }

  const Scene& scene_;
  const EnclosureOptions& options_;
  double tolerance_N_;
  int held_ = 0;  ///< earlier slices in which a command acting in the present one may have been computed
  int remembered_ = 0;  ///< earlier slices whose states the network may still act upon
  std::vector<std::vector<std::array<AxisInSlices, 3>>> axes_;  ///< [part][vehicle]
  std::vector<ByPart> past_;                                    ///< one per slice
  Signals last_;
};

}  // namespace

Deviations SlicedTube::whole() const { return united(slices); }

SlicedTube sliced_tube(const Scene& scene, const EnclosureOptions& options, double tolerance_N,
                       double farthest_m) {
  SlicedTube tube;
  tube.force_error_N.resize(static_cast<std::size_t>(scene.vehicles()));
  tube.truth.resize(tube.force_error_N.size());
  tube.hold_N.resize(tube.force_error_N.size());
  Sweep sweep(scene, options, tolerance_N);
  for (int n = 0; n < scene.motion().slices; ++n) {
    if (!sweep.advance(tube, farthest_m)) {
      tube.cancelled = tube.why.empty();
      if (tube.cancelled) tube.why = "interrupted";
      return tube;
    }
    if (options.progress) options.progress(n + 1, scene.motion().slices);
  }
  tube.proved = true;
  return tube;
}

}  // namespace swarmcert::analysis
