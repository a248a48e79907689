/// @file Worst gains over intervals of mass, thrust, lag and delay, enclosed from both sides.
#pragma once

#include "stability/bounds/axis_loop.h"
#include "stability/bounds/sampled_loop.h"

namespace swarmcert::stability {

struct Range {
  double from = 0, to = 0;
};

/// What may vary about one axis, each within its range, independently and constant in time.
struct UncertainPlant {
  Range mass_kg;       ///< the true one; gains are forces for `commanded_mass_kg`
  Range thrust_scale;  ///< force that acts per force commanded
  Range lag_s;         ///< of the motors
  Range delay_s;
};

/// One gain: at some point of the box it reaches `lower`; nowhere in the box does it exceed `upper`.
struct UncertainGain {
  double lower = 0, upper = 0;
  double mass_kg = 0, thrust_scale = 0, lag_s = 0, delay_s = 0;  ///< where it reaches `lower`
};

struct UncertainNorms {
  UncertainGain rate, amplitude, edge, impulse;
  int evaluations = 0;
};

/// Supremum of each gain over the box, by subdivision of (thrust/mass, lag, delay). On a part, the true loop is that of
/// its centre with the acceleration a that its actuators give changed to (1 + Delta) a; see uncertain_norms.cpp for the
/// small-gain bounds. Parts are refined until upper <= (1 + gap) lower or the budget is spent. The norms of the centres
/// are those of continuous_norms(), to rounding. Infinite upper: not proved stable.
/// @param loop mass: what the controller was told; gains as written; lags: those that do not vary (attitude).
UncertainNorms uncertain_norms(const AxisLoop& loop, const UncertainPlant& plant, Channel channel,
                               double relative_gap = 0.01, int most_evaluations = 1500);

/// The same for the sampled loop: `lower` is reached at the sampling instants, `upper` holds at all times.
UncertainNorms uncertain_norms(const SampledLoop& loop, const UncertainPlant& plant, Channel channel,
                               double relative_gap = 0.03, int most_evaluations = 400);

}  // namespace swarmcert::stability
