/// @file Enclosures of the largest slopes of one vehicle's wake. Not for users: see truth_bounds.h.
#pragma once

#include "nn/base/interval.h"

namespace swarmcert::stability {

/// g(r, z) = u(z) (0.3/h)^decay exp(-r^2 / (2 (spread + slope h)^2)) at height gap z and horizontal distance r, with
/// h = max(z, 0.12 m), for z > 0.05 m; 0 else. u is 1, or with `fades` the smooth step from 0 at 0.05 m to 1 at 0.12 m.
struct WakeField {
  double decay = 0;
  double spread_m = 0, spread_slope = 0;
  double convection_s_m = 0;
  bool fades = false;
};

/// Suprema over all r and the given range of gaps, each enclosed: `lower` is attained at a point, `upper` never
/// exceeded.
struct FieldSlopes {
  Interval value;   ///< g
  Interval total;   ///< |gradient|
  Interval across;  ///< |dg/dr|
  Interval along;   ///< |dg/dz|
};

/// Computes the suprema by interval subdivision of the strip of r / spread and z, to a relative gap of about 1e-3.
/// Slopes are infinite if the field has a jump (no fading) within the range of gaps.
FieldSlopes field_slopes(const WakeField& field, double least_gap_m, double largest_gap_m);

}  // namespace swarmcert::stability
