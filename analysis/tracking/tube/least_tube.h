/// @file The least tube around a task's trajectories that a bound of the force error proves.
#pragma once

#include <limits>
#include <string>

#include "analysis/tracking/tube/force_bound.h"

namespace swarmcert::analysis {

struct LeastTube {
  bool proved = false;
  Radii radii;                    ///< where proved
  std::vector<double> force_N;    ///< sup |f_hat - f_a| in it, per stretch
  std::vector<TruthSizes> truth;  ///< of the declared truth in it, or in a larger tube
  double loop_gain =
      0;            ///< how much an error of one metre adds to its own bound, at the last radius looked at
  std::string why;  ///< where not proved
  bool cancelled = false;

  double radius_m(int axis) const { return radii.largest_position_m(axis); }
  double radius_m() const;
};

/// Looks for the least radii r with B(r) < r, entry by entry, where B(r) are the bounds of e and e' that the force
/// error within r allows (Scene::errors_z(), Scene::other_errors(), Scene::hold_errors()).
///
/// Why such a tube holds. Errors start at zero and are continuous. Were one to leave the tube, there would be a first
/// time t at which one reaches its radius; until then every state lies in the tube, the controller and the network have
/// seen nothing else, and so the errors up to t are at most B(r) < r: a contradiction. This needs the loop of
/// error_loops.h to be the one that flies: continuous, or sampled with its first command at t = 0; exact measurements,
/// thrust not saturated, axes uncoupled, the integrator within its limit (see LocalTube::assumptions). That the sampled
/// loop acts on states of the last period is in Scene::hold_errors() and Scene::network_age_s(). f_hat may be a
/// staircase: that its states are up to Scene::network_age_s() old is in the bounds of the force error.
///
/// How it is found. B is monotone, so r <- B(r) from r = 0 rises to the least fixed point; the bounds of the force
/// error are prepared for a larger tube, and cheap inside it. A tube that is proved is the larger one of the next
/// round. Only B(r) < r, evaluated with every rounding accounted for, proves anything.
/// @param farthest_m gives up beyond this radius.
/// @param wanted_m a wider tube is of no use: gives up beyond it, and at once where B(0) leaves no room below it.
LeastTube least_tube(const Scene& scene, ForceBound& bound, double farthest_m = 0.5,
                     double wanted_m = std::numeric_limits<double>::infinity());

}  // namespace swarmcert::analysis
