/// @file The smallest tube around a task's trajectories that a bound of the force error proves.
#pragma once

#include <limits>
#include <string>

#include "analysis/tracking/tube/force_bound.h"

namespace swarmcert::analysis {

struct LeastTube {
  bool proved = false;
  Radii radii;                    ///< valid if proved
  std::vector<double> force_N;    ///< sup |f_hat - f_a| in the tube, per stretch
  std::vector<TruthSizes> truth;  ///< the declared truth in the tube, or in a larger one
  double loop_gain =
      0;            ///< factor by which an error of one metre adds to its own bound, at the last radius tried
  std::string why;  ///< reason if not proved
  bool cancelled = false;

  double radius_m(int axis) const { return radii.largest_position_m(axis); }
  double radius_m() const;
};

/// Searches for the least radii r with B(r) < r, entry by entry, where B(r) bounds e and e' for the force error that is
/// possible within r (Scene::errors_z(), Scene::other_errors(), Scene::hold_errors()).
///
/// Proof that such a tube holds: errors start at zero and are continuous. Suppose that one of them left the tube, and
/// let t be the first time at which one reaches its radius. Until t every state lies in the tube, so controller and
/// network have seen nothing else, and the errors up to t are at most B(r) < r: a contradiction. This requires the loop
/// of error_loops.h to be the one used in flight: continuous, or sampled with its first command at t = 0; exact
/// measurements, thrust not saturated, axes uncoupled, the integrator within its limit (see LocalTube::assumptions).
/// Scene::hold_errors() and Scene::network_age_s() account for the sampled loop acting on states of the last period.
/// f_hat may be a staircase: the bounds of the force error include states up to Scene::network_age_s() old.
///
/// Search: B is monotone, so r <- B(r) from r = 0 increases to the least fixed point. The bounds of the force error are
/// prepared for a larger tube and are cheap inside it. A proved tube becomes the larger tube of the next round. Only
/// B(r) < r, evaluated with every rounding accounted for, is the proof.
/// @param farthest_m gives up beyond this radius.
/// @param wanted_m wider tubes are useless: gives up beyond it, and at once if B(0) leaves no room below it.
LeastTube least_tube(const Scene& scene, ForceBound& bound, double farthest_m = 0.5,
                     double wanted_m = std::numeric_limits<double>::infinity());

}  // namespace swarmcert::analysis
