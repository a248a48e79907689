/// @file Worst gains over intervals of mass, thrust, lag and delay, enclosed from both sides.
#pragma once

#include <functional>

#include "nn/base/interval.h"
#include "stability/bounds/loops/axis_loop.h"
#include "stability/bounds/loops/sampled_loop.h"

namespace swarmcert::stability {

/// Uncertain parameters of one axis, each constant in time and within its range, independently.
struct UncertainPlant {
  Interval mass_kg;       ///< the true mass; the gains are forces for `commanded_mass_kg`
  Interval thrust_scale;  ///< actual force per commanded force
  Interval lag_s;         ///< of the motors
  Interval delay_s;
};

/// Stopping criteria. The bounds are valid whenever the search stops.
struct UncertainEffort {
  double relative_gap = 0.01;   ///< stops if upper <= (1 + gap) lower for every gain
  int most_evaluations = 2000;  ///< number of loops
  /// Called occasionally with the number of loops evaluated and the largest upper/lower - 1; returns false to stop.
  std::function<bool(int evaluations, double gap)> go_on = {};
};

/// One gain: attains `lower` at some point of the box; never exceeds `upper` in the box.
struct UncertainGain {
  double lower = 0, upper = 0;
  double mass_kg = 0, thrust_scale = 0, lag_s = 0, delay_s = 0;  ///< point that attains `lower`
};

struct UncertainNorms {
  UncertainGain rate, amplitude, edge, impulse;
  int evaluations = 0;
  enum class End {
    kGap,     ///< the requested gap is reached, or a point of the box is unstable
    kBudget,  ///< the maximum number of loops was evaluated
    kStopped  ///< go_on() returned false
  } end = End::kGap;
};

/// Bounds the supremum of each gain over the box. Of all vehicles with the same thrust-to-mass ratio the lightest has
/// the largest gains. It lies on one of two edges, that of the least mass or that of the least thrust, so the search
/// subdivides boxes of (ratio, lag, delay) on an edge. Over a subbox a gain is at most its largest value at the
/// corners, plus the interpolation error of the response between them: a norm is convex, so that of a multilinear
/// interpolation is largest at a corner, and the interpolation error is at most (width^2/8 sup |second derivative|) for
/// each dimension, without mixed derivatives. The derivatives are bounded over the subbox by a small-gain argument
/// around its centre; see uncertain_continuous.cpp and uncertain_sampled.cpp. Where this does not yet give a finite
/// bound, small gain alone is used. The subbox with the largest gap is halved in the dimension that contributes most.
/// Norms at points are those of continuous_norms() and sampled_norms(), with round-off. Infinite upper: not proved
/// stable.
/// @param loop mass: the one the controller assumes; gains as written; lags: those that do not vary (attitude).
UncertainNorms uncertain_norms(const AxisLoop& loop, const UncertainPlant& plant, Channel channel,
                               const UncertainEffort& effort = {});

/// The same for the sampled loop: `lower` is attained at the sampling instants, `upper` holds at all times.
UncertainNorms uncertain_norms(const SampledLoop& loop, const UncertainPlant& plant, Channel channel,
                               const UncertainEffort& effort = {});

}  // namespace swarmcert::stability
