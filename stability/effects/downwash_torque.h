/// @file Torque of the downwash of the vehicles above, which is not the same at each rotor.
///
/// The wake of downwash.h, taken at each of the four rotors r_k (body, X arrangement) instead of the centre:
///   tau_B = sum_k r_k x R' (0, 0, f_k),   f_k = -(A / 4) (sum_j g_j(p_j - p - R r_k)^p)^(1/p).
/// With an arm a that is short against the wake, a level vehicle has tau = a^2 / 2 (d f_z / dy, -d f_z / dx, 0): the
/// slope of downwash's vertical force over its own position. That force is downwash's; models that want both name both.
#pragma once

#include <vector>

#include "stability/effects/downwash.h"

namespace swarmcert::stability {

class DownwashTorque : public Effect {
 public:
  DownwashTorque() : Effect(describe()) {}
  static EffectInfo describe();
  void columns(const Instant& now, const double* shape, Wrench* columns) const override;
  bool in_support(const Instant& now, const double* shape) const override;
  double reach_m(double dz_m, const double* shape) const override;

 private:
  Downwash downwash_;
  mutable std::vector<Neighbour> at_rotor_;  ///< scratch: the neighbours as one rotor meets them
};

}  // namespace swarmcert::stability
