/// @file The tracking bound over intervals of the vehicle's parameters.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "stability/bounds/flown_loop.h"
#include "stability/bounds/tracking_bounds.h"
#include "stability/bounds/uncertain/uncertain_norms.h"

namespace swarmcert::gate {

/// Tracking bounds per axis of the loop used in flight, which is the sampled loop if gains.toml states a rate.
struct BoxBound {
  bool is_enclosed = false;  ///< whether `enclosed_m` holds in the whole box
  /// Largest bound at the corners and the centre of the box, for both channels, including float32 errors. NaN if an
  /// axis is coupled.
  double reached_m[3] = {0, 0, 0};
  double enclosed_m[3] = {0, 0, 0};  ///< no plant in the box has a larger bound; infinite: not proved stable
  std::string where[3];              ///< location of `reached_m`
  /// That with the least margin at the corners and the centre. No bound holds unless it is proved.
  stability::Saturation saturation;
};

/// Bounds for `source` over the box. The enclosure by uncertain_norms() is the smallest of the bounds by rate, by
/// amplitude and, for a single pass, by edges and by impulse. If the clamp of an integrator may act, it is the bound
/// of the loop without integral action, which holds whether the clamp acts or not (ClampBounds). Sampled loops with a
/// clamp have no enclosure, only corner values.
BoxBound bound_over(const stability::FlownLoop& setup, const stability::UncertainPlant& box,
                    const stability::DisturbanceSource& source);

}  // namespace swarmcert::gate
