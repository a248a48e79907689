/// @file Searches a disturbance under which a swarm's errors diverge, which refutes a small-gain claim.
#pragma once

#include <optional>
#include <vector>

#include "stability/bounds/loops/axis_loop.h"
#include "stability/bounds/swarms/small_gain.h"

namespace swarmcert::stability {

/// Forces of the class |eps_on'| <= Lp |v_rel| + Lv |a_rel|: eps_on = sign (Lp (e_on - e_by) + Lv (e_on' - e_by')).
struct UnstableSwarm {
  /// Whether every coupling's direction was stated: then this is the swarm as declared, else one of its class.
  bool is_declared = false;
  std::vector<int> sign;     ///< of each coupling: +1 pushes vehicles apart
  double growth_1_s = 0;     ///< largest real part of an eigenvalue of the swarm under these forces
  double seconds = 0;        ///< of the simulation that follows
  double largest_error = 0;  ///< in it, over the error at its start: at least 1000
};

/// Looks for signs, where couplings state none, under which the swarm of linear loops (continuous, command channel,
/// lags included) is unstable: all combinations of up to eight couplings, else all alike; and replays what it finds
/// with classical Runge-Kutta steps from one displaced vehicle. Nothing where none is found, or for loops with a delay.
/// @throws std::invalid_argument as small_gain().
std::optional<UnstableSwarm> find_unstable_swarm(const AxisLoop& loop, int vehicles,
                                                 const std::vector<Coupling>& couplings);

}  // namespace swarmcert::stability
