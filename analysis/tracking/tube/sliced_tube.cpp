#include "analysis/tracking/tube/sliced_tube.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "nn/base/parallel.h"

namespace swarmcert::analysis {

namespace {

using stability::KernelCells;

constexpr int kMostTries = 12;
/// What is tried is this much wider than what came out last, relatively and in m or m/s.
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

bool every_inside(const Deviations& inner, const Deviations& outer) {
  bool result = true;
  each(inner, outer, [&result](Interval a, Interval b) {
    result = result && inside(a, b);
    return a;
  });
  return result;
}

Deviations hull_of(const Deviations& a, const Deviations& b) {
  return each(a, b, [](Interval x, Interval y) { return hull(x, y); });
}

/// Signals of one vehicle and axis, and what all but the present slice do to the error.
struct Axis {
  const ErrorLoop* loop = nullptr;
  std::vector<Interval> force, lagging;  ///< d and w, slices so far; of m x the part HeldAnswer::mean_N
  std::vector<Interval> whole_force;     ///< d with all of m x
  std::vector<Interval> sawtooth;        ///< +- HeldAnswer::sawtooth_N_s
  std::vector<Interval> acceleration;    ///< e'', likewise
  LoopHistory met;                       ///< likewise
  const LagStart* start = nullptr;       ///< of the rotors; null: there is none
  Interval excess_N{0};                  ///< their thrust beyond the weight at the start
  const EstimateAnswer* estimates = nullptr;
  Interval position_m, velocity_m_s;  ///< from the slices before
  Interval acceleration_m_s2;         ///< likewise; where the loop is sampled

  void begin_slice() {
    const std::size_t n = force.size();
    position_m = answer_to_past(*loop->h1, force, n);
    velocity_m_s = answer_to_past(*loop->h2, force, n);
    const double of_estimates_m = estimates->errors.position_m[n];
    const double of_estimates_m_s = estimates->errors.velocity_m_s[n];
    if (of_estimates_m > 0 || of_estimates_m_s > 0) {
      position_m += Interval(-of_estimates_m, of_estimates_m);
      velocity_m_s += Interval(-of_estimates_m_s, of_estimates_m_s);
    }
    if (loop->period_s > 0) {
      begin_acceleration(n);
      const double of_estimates_m_s2 = estimates->acceleration_m_s2[n];
      if (of_estimates_m_s2 > 0) acceleration_m_s2 += Interval(-of_estimates_m_s2, of_estimates_m_s2);
    }
    if (loop->has_whole_periods) {
      position_m += answer_to_past(*loop->slope1, sawtooth, n);
      velocity_m_s += answer_to_past(*loop->slope2, sawtooth, n);
    }
    if (!loop->has_lag) return;
    if (start != nullptr) {
      position_m += excess_N * start->position_m[n];
      velocity_m_s += excess_N * start->velocity_m_s[n];
    }
    position_m += answer_to_past(*loop->g1, lagging, n);
    velocity_m_s += answer_to_past(*loop->g2, lagging, n);
  }

  static Interval last(const std::vector<Interval>& past) { return past.empty() ? Interval(0) : past.back(); }

  void begin_acceleration(std::size_t n) {
    if (!loop->has_lag) {
      acceleration_m_s2 = -answer_to_past(*loop->direct_rest, whole_force, n);
      return;
    }
    acceleration_m_s2 = answer_to_past(*loop->h3, force, n) - answer_to_past(*loop->direct_rest, lagging, n);
    if (loop->has_whole_periods) acceleration_m_s2 += answer_to_past(*loop->slope3, sawtooth, n);
    if (start != nullptr) acceleration_m_s2 += excess_N * start->acceleration_m_s2[n];
  }

  /// m x and e'' of this slice if its signals without m x are d and w, e' is `velocity` since a period ago.
  /// @param back slices before this one in which a command that acts in this one may have been made.
  HeldAnswer held(Interval d, Interval w, Interval velocity, Interval jerk_m_s3, const LoopHistory& history,
                  std::size_t back) const {
    const std::size_t n = force.size();
    const auto with_last = [](Interval now, const std::vector<Interval>& past) {
      return hull(now, last(past));
    };
    const Interval direct = Interval(1) / loop->mass_kg;
    HeldSlice slice;
    slice.velocity_m_s = velocity;
    slice.history = history;
    slice.jerk_m_s3 = jerk_m_s3;
    const KernelCells& rest = *loop->direct_rest;
    if (loop->has_lag) {
      slice.acceleration_m_s2 = acceleration_m_s2 + stability::answer(*loop->h3, 0, with_last(d, force)) +
                                direct * w - stability::answer(rest, 0, with_last(w, lagging));
      slice.per_N = slice.per_rising_N = loop->h3->integral[0];
      if (loop->has_whole_periods) {
        slice.acceleration_m_s2 += stability::answer(*loop->slope3, 0, last(sawtooth));
        slice.per_rising_N = std::min(
            slice.per_N,
            up(up(loop->h3->integral[0] / 2) + up(up(loop->period_s / 8) * loop->slope3->integral[0])));
      }
    } else {
      slice.acceleration_m_s2 =
          acceleration_m_s2 + direct * d - stability::answer(rest, 0, with_last(d, whole_force));
      slice.per_N = slice.per_rising_N = (direct + rest.integral[0]).upper;
    }
    slice.acceleration_before_m_s2 = slice.acceleration_m_s2;
    for (std::size_t k = n - std::min(back, n); k < n; ++k) {
      slice.acceleration_before_m_s2 = hull(slice.acceleration_before_m_s2, acceleration[k]);
    }
    for (const Interval& a : acceleration)
      slice.largest_acceleration_m_s2 = std::max(slice.largest_acceleration_m_s2, a.mag());
    return hold_error(*loop, slice);
  }

  /// The errors of this slice if its signals are these. @param saw bounds the integral of the sawtooth in d, N s.
  void answer(Interval d, Interval w, double saw, Interval& position, Interval& velocity) const {
    const Interval both_d = hull(d, last(force));
    position = position_m + stability::answer(*loop->h1, 0, both_d);
    velocity = velocity_m_s + stability::answer(*loop->h2, 0, both_d);
    if (loop->has_whole_periods) {
      const Interval both_saw = hull(Interval(-saw, saw), last(sawtooth));
      position += stability::answer(*loop->slope1, 0, both_saw);
      velocity += stability::answer(*loop->slope2, 0, both_saw);
    }
    if (!loop->has_lag) return;
    const Interval both_w = hull(w, last(lagging));
    position += stability::answer(*loop->g1, 0, both_w);
    velocity += stability::answer(*loop->g2, 0, both_w);
  }
};

class Sweep {
 public:
  Sweep(const Scene& scene, const EnclosureOptions& options, double tolerance_N)
      : scene_(scene), options_(options), tolerance_N_(tolerance_N) {
    for (int i = 0; i < scene.vehicles(); ++i) {
      axes_.emplace_back();
      for (std::size_t k = 0; k < 3; ++k) {
        axes_.back()[k].loop = &scene.loops().axis[k];
        axes_.back()[k].estimates = &scene.estimate_answer(k);
      }
      if (!scene.loops().axis[2].has_lag) continue;
      axes_.back()[2].start = &scene.lag_start_z();
      axes_.back()[2].excess_N = scene.excess_at_start_N(i);
    }
    // Where slices are whole periods, only their borders are rounded.
    const ErrorLoop& loop = scene.loops().axis[0];
    if (loop.period_s > 0)
      held_ = loop.has_whole_periods
                  ? 1
                  : static_cast<int>(std::ceil(loop.period_s / scene.motion().slice_s * (1 + 1e-9)));
    remembered_ = static_cast<int>(std::ceil(scene.network_age_s() / scene.motion().slice_s + 1e-9));
  }

  /// @returns false where no tube was found for the next slice, or it was cancelled.
  bool advance(SlicedTube& tube, double farthest_m) {
    const auto n = static_cast<int>(tube.slices.size());
    const auto count = static_cast<std::size_t>(scene_.vehicles());
    for (auto& of_vehicle : axes_)
      for (Axis& axis : of_vehicle) axis.begin_slice();
    // As if the signals stood still.
    Signals signals = n == 0 ? Signals(count) : last_;
    Deviations tried;
    for (int i = 0; i < kMostTries; ++i) {
      const Deviations answered = answers(signals);
      if (i > 0 && every_inside(answered, tried)) {
        keep(signals, answered, tube);
        return true;
      }
      const Deviations next = each(answered, answered, [](Interval x, Interval) { return wider(x); });
      tried = i == 0 ? next : hull_of(tried, next);
      double largest_m = 0;
      for (const Deviation& one : tried)
        for (const Interval& x : one.position_m) largest_m = std::max(largest_m, x.mag());
      if (!(largest_m <= farthest_m)) {
        tube.why =
            fmt::format("at {:.3g} s errors could exceed {:g} m", n * scene_.motion().slice_s, farthest_m);
        return false;
      }
      const auto with_past = [&](int slices) {
        Deviations result = tried;
        for (int back = 1; back <= std::min(slices, n); ++back)
          result = hull_of(result, tube.slices[static_cast<std::size_t>(n - back)]);
        return result;
      };
      const Deviations seen = with_past(remembered_), recent = with_past(held_);
      files::parallel_for(scene_.vehicles(), options_.jobs, [&](int v) {
        signals[static_cast<std::size_t>(v)] = signals_of(v, n, seen, recent);
      });
      if (options_.cancelled != nullptr && *options_.cancelled) return false;
    }
    tube.why = fmt::format("no tube was found that holds at {:.3g} s", n * scene_.motion().slice_s);
    return false;
  }

 private:
  struct Signal {
    Interval difference_N;  ///< f_hat - f_a
    TruthSizes truth;
    Interval lagging_N[3];
    LoopHistory met[3];  ///< up to the end of the slice
    HeldAnswer held[3];  ///< 0 where the loop is continuous
  };
  using Signals = std::vector<Signal>;

  /// @param seen what a prediction that acts in the slice may rest on.
  /// @param recent what a command that acts in it may rest on.
  Signal signals_of(int vehicle, int slice, const Deviations& seen, const Deviations& recent) const {
    const Motion& motion = scene_.motion();
    const int s = motion.stretch_of[static_cast<std::size_t>(vehicle)][static_cast<std::size_t>(slice)];
    const Stretch& stretch = motion.stretches[static_cast<std::size_t>(s)];
    ForceDifference difference(scene_, stretch, seen);
    difference.refine(options_.boxes, tolerance_N_, options_.cancelled);
    Signal signal;
    signal.difference_N = difference.over(seen);
    signal.truth = scene_.truth_sizes(stretch, seen);
    const Interval mass_kg(scene_.tracking().plant.mass_kg);
    const auto i = static_cast<std::size_t>(vehicle);
    for (std::size_t k = 0; k < 3; ++k) {
      signal.lagging_N[k] = signal.truth.force_N[k] - mass_kg * stretch.acceleration_now_m_s2[k];
      signal.met[k] = axes_[i][k].met;
      signal.met[k].add(scene_.in_slice(stretch, slice, k, signal.difference_N.mag(), signal.truth,
                                        seen[i].position_m[k].mag(), seen[i].velocity_m_s[k].mag()));
      if (scene_.loops().is_sampled()) {
        signal.held[k] =
            axes_[i][k].held(known_force(signal, k), signal.lagging_N[k], recent[i].velocity_m_s[k],
                             stretch.jerk_m_s3[k], signal.met[k], static_cast<std::size_t>(held_));
      }
    }
    return signal;
  }

  static Interval known_force(const Signal& signal, std::size_t axis) {
    return axis == 2 ? -signal.difference_N : signal.truth.force_N[axis];
  }

  Interval force(const Signal& signal, std::size_t axis) const {
    const Interval known = known_force(signal, axis);
    return scene_.loops().is_sampled() ? known + signal.held[axis].mean_N : known;
  }

  Deviations answers(const Signals& signals) const {
    Deviations result(signals.size());
    for (std::size_t i = 0; i < signals.size(); ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        axes_[i][k].answer(force(signals[i], k), signals[i].lagging_N[k], signals[i].held[k].sawtooth_N_s,
                           result[i].position_m[k], result[i].velocity_m_s[k]);
      }
    }
    return result;
  }

  void keep(const Signals& signals, const Deviations& answered, SlicedTube& tube) {
    for (std::size_t i = 0; i < signals.size(); ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        const HeldAnswer& held = signals[i].held[k];
        axes_[i][k].force.push_back(force(signals[i], k));
        axes_[i][k].whole_force.push_back(known_force(signals[i], k) + held.hold_N);
        axes_[i][k].sawtooth.emplace_back(-held.sawtooth_N_s, held.sawtooth_N_s);
        axes_[i][k].lagging.push_back(signals[i].lagging_N[k]);
        axes_[i][k].met = signals[i].met[k];
        axes_[i][k].acceleration.push_back(held.acceleration_m_s2);
        tube.hold_N[i][k].push_back(held.hold_N.mag());
      }
      tube.force_error_N[i].push_back(signals[i].difference_N);
      tube.truth[i].push_back(signals[i].truth);
    }
    tube.slices.push_back(answered);
    last_ = signals;
  }

  const Scene& scene_;
  const EnclosureOptions& options_;
  double tolerance_N_;
  int held_ = 0;  ///< slices before the present one in which a command that acts in it may have been made
  int remembered_ = 0;  ///< slices before the present one whose states the network may still act upon
  std::vector<std::array<Axis, 3>> axes_;
  Signals last_;
};

}  // namespace

Radii SlicedTube::radii() const {
  Radii result = Radii::none(static_cast<int>(force_error_N.size()));
  for (const Deviations& slice : slices) {
    for (std::size_t i = 0; i < slice.size(); ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        result.position_m[i][k] = std::max(result.position_m[i][k], slice[i].position_m[k].mag());
        result.velocity_m_s[i][k] = std::max(result.velocity_m_s[i][k], slice[i].velocity_m_s[k].mag());
      }
    }
  }
  return result;
}

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
      return tube;
    }
    if (options.progress) options.progress(n + 1, scene.motion().slices);
  }
  tube.proved = true;
  return tube;
}

}  // namespace swarmcert::analysis
