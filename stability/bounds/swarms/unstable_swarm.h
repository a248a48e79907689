/// @file Searches a disturbance under which a swarm's errors diverge, which refutes a small-gain claim.
#pragma once

#include <optional>
#include <vector>

#include "stability/bounds/loops/axis_loop.h"
#include "stability/bounds/swarms/small_gain.h"

namespace swarmcert::stability {

/// Instances of the class |eps_on'| <= Lp |v_rel| + Lv |a_rel|: eps_on = sign (Lp (e_on - e_by) + Lv (e_on' - e_by')).
struct UnstableSwarm {
  /// True if every coupling's direction was stated; this is then the swarm as declared, else one of its class.
  bool is_declared = false;
  std::vector<int> sign;     ///< of each coupling: +1 pushes the vehicles apart
  double growth_1_s = 0;     ///< largest real part of an eigenvalue of the swarm under these forces
  double seconds = 0;        ///< duration of the simulation
  double largest_error = 0;  ///< in the simulation, relative to the initial error: at least 1000
};

/// Searches signs, for couplings without a stated one, under which the swarm of linear loops (continuous, command
/// channel, lags included) is unstable: all combinations for up to eight couplings, else the same sign for all. Replays
/// the result with classical Runge-Kutta steps from one displaced vehicle. Returns nothing if none is found, or for
/// loops with a delay.
/// @throws std::invalid_argument like small_gain().
std::optional<UnstableSwarm> find_unstable_swarm(const AxisLoop& loop, int vehicles,
                                                 const std::vector<Coupling>& couplings);

}  // namespace swarmcert::stability
