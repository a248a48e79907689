/// @file Thrust mixing of eight vehicles at once while no rotor saturates.
#pragma once

#include "controller/mixing.h"
#include "stability/bodies/lanes.h"

namespace swarmcert::stability {

/// Equivalent to controller::mix(), with bitwise identical results. The flight code selects this overload for Lanes
/// because it is not a template and is found by argument-dependent lookup.
SWARMCERT_LANE inline controller::Mixed<Lanes> mix(const controller::Allocation<Lanes>& allocation,
                                                   const controller::ForceLimits<Lanes>& limits,
                                                   const controller::Wrench<Lanes>& wanted) {
  const Lanes zero(0), one(1);
  controller::Mixed<Lanes> result;
  if (allocation.rank == 4) {
    // As in controller::mix() when the thrust is feasible and all shares are 1. A non-finite wrench fails a comparison.
    Lanes::Choice within = is_finite(limits.lower_N) && is_finite(limits.upper_N);
    for (int i = 0; i < allocation.count; ++i) {
      const Lanes(&per)[4] = allocation.inverse[i];
      const Lanes thrust = product(per[0], wanted.thrust_N);
      const Lanes tilt = product(per[1], wanted.torque_N_m.x) + product(per[2], wanted.torque_N_m.y);
      const Lanes yaw = product(per[3], wanted.torque_N_m.z);
      const Lanes tilted = thrust + tilt;
      const Lanes force =
          clamp(thrust + product(one, tilt) + product(zero, yaw), limits.lower_N, limits.upper_N);
      const Lanes end = force + product(one, yaw);
      within = within && thrust >= limits.lower_N && thrust <= limits.upper_N && tilted >= limits.lower_N &&
               tilted <= limits.upper_N && end >= limits.lower_N && end <= limits.upper_N;
      result.forces.at_N[i] = clamp(end, limits.lower_N, limits.upper_N);
    }
    if (within.lanes() == Lanes::kAll) {
      result.valid = true;
      result.thrust_N = wanted.thrust_N;
      return result;
    }
  }
  return controller::mix<Lanes>(allocation, limits, wanted);
}

}  // namespace swarmcert::stability
