/// @file Worst gains over intervals of mass, thrust, lag and delay, enclosed from both sides.
#pragma once

#include <array>

#include "stability/bounds/axis_loop.h"

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

/// Supremum of each gain over the box, by subdivision. On a part around a centre, the true loop is the centre's with
/// its command multiplied by 1 + Delta, so by small gain in the sup norm every gain is at most the centre's over
/// 1 - |T Delta|_1, T the loop from command to command: |Delta| <= relative change of thrust/mass + 2 |dlag|/lag, and a
/// change of delay enters as |ddelay| |T'|_1. Parts are refined until upper <= (1 + gap) lower or the budget is spent.
/// The norms of the centres are those of continuous_norms(), to rounding. Infinite upper: not proved stable.
/// @param loop mass: what the controller was told; gains as written; lags: those that do not vary (attitude).
UncertainNorms uncertain_norms(const AxisLoop& loop, const UncertainPlant& plant, Channel channel,
                               double relative_gap = 0.01, int most_evaluations = 1500);

}  // namespace swarmcert::stability
