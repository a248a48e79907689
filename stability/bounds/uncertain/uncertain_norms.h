/// @file Worst gains over intervals of mass, thrust, lag and delay, enclosed from both sides.
#pragma once

#include <functional>

#include "nn/base/interval.h"
#include "stability/bounds/loops/axis_loop.h"
#include "stability/bounds/loops/sampled_loop.h"

namespace swarmcert::stability {

/// What may vary about one axis, each within its range, independently and constant in time.
struct UncertainPlant {
  Interval mass_kg;       ///< the true one; gains are forces for `commanded_mass_kg`
  Interval thrust_scale;  ///< force that acts per force commanded
  Interval lag_s;         ///< of the motors
  Interval delay_s;
};

/// When to stop. Bounds hold whenever that is.
struct UncertainEffort {
  double relative_gap = 0.01;   ///< reached where upper <= (1 + gap) lower for every gain
  int most_evaluations = 2000;  ///< loops
  /// Called now and then with the loops looked at and the largest upper/lower - 1; false: stop.
  std::function<bool(int evaluations, double gap)> go_on = {};
};

/// One gain: at some point of the box it reaches `lower`; nowhere in the box does it exceed `upper`.
struct UncertainGain {
  double lower = 0, upper = 0;
  double mass_kg = 0, thrust_scale = 0, lag_s = 0, delay_s = 0;  ///< where it reaches `lower`
};

struct UncertainNorms {
  UncertainGain rate, amplitude, edge, impulse;
  int evaluations = 0;
  enum class End {
    kGap,     ///< the gap asked for is reached, or a point of the box is unstable
    kBudget,  ///< as many loops as were allowed
    kStopped  ///< go_on() said no
  } end = End::kGap;
};

/// Supremum of each gain over the box. Of all vehicles with the same ratio of thrust to mass the lightest has the
/// largest gains: it lies on one of two edges, that of the least mass or that of the least thrust, so parts are boxes
/// of (ratio, lag, delay) on an edge. Over a part a gain is at most its largest at the corners, plus what the response
/// may bend between them: a norm is convex, so that of a multilinear interpolation is largest at a corner, and
/// interpolation misses a response by (width^2/8 sup |second derivative|) of each dimension, no mixed ones. Derivatives
/// are bounded over the part by a small gain around its centre; see uncertain_continuous.cpp and uncertain_sampled.cpp.
/// Where that gives nothing yet, small gain alone does. The part farthest from what was reached is halved in the
/// dimension that adds most. Norms at points are those of continuous_norms() and sampled_norms(), to rounding. Infinite
/// upper: not proved stable.
/// @param loop mass: what the controller was told; gains as written; lags: those that do not vary (attitude).
UncertainNorms uncertain_norms(const AxisLoop& loop, const UncertainPlant& plant, Channel channel,
                               const UncertainEffort& effort = {});

/// The same for the sampled loop: `lower` is reached at the sampling instants, `upper` holds at all times.
UncertainNorms uncertain_norms(const SampledLoop& loop, const UncertainPlant& plant, Channel channel,
                               const UncertainEffort& effort = {});

}  // namespace swarmcert::stability
