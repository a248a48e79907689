/// @file Lift on a vehicle that flies over others, caused by the inflow of their rotors.
#pragma once

#include "stability/effects/effect.h"

namespace swarmcert::stability {

class UpperLift : public Effect {
 public:
  UpperLift() : Effect(describe()) {}
  static EffectInfo describe();
  void columns(const Instant& now, const double* shape, Wrench* columns) const override;
  bool in_support(const Instant& now, const double* shape) const override;
  double reach_m(double dz_m, const double* shape) const override;
};

}  // namespace swarmcert::stability
