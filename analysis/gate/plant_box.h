/// @file The tracking bound over intervals of the vehicle's parameters.
#pragma once

#include <string>
#include <vector>

#include "stability/bounds/tracking_bounds.h"
#include "stability/bounds/tracking_setup.h"
#include "stability/bounds/uncertain/uncertain_norms.h"

namespace swarmcert::gate {

/// Tracking bounds of the loop that flies, the sampled one where gains.toml has a rate, per axis.
struct BoxBound {
  bool is_enclosed = false;  ///< whether `enclosed_m` holds everywhere in the box
  /// Largest bound at the corners and the middle of the box, both channels, what float32 costs included. NaN: an axis
  /// has no loop of its own.
  double reached_m[3] = {0, 0, 0};
  double enclosed_m[3] = {0, 0, 0};  ///< no plant of the box has a larger bound; infinite: not proved stable
  std::string where[3];              ///< of `reached_m`
};

/// Bounds for `source` over the box. Enclosed by uncertain_norms(): the smallest of the bounds by rate, by amplitude
/// and, for a single pass, by edges and by impulse; where an integrator's clamp may act, that of the loop without
/// integral, which holds whether it acts or not (ClampBounds). Sampled loops with a clamp have no enclosure, only
/// corners.
BoxBound bound_over(const stability::TrackingSetup& setup, const stability::UncertainPlant& box,
                    const stability::DisturbanceSource& source);

}  // namespace swarmcert::gate
