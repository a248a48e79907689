/// @file A constant force in the world: steady wind, a tilted thrust axis, a biased accelerometer.
#pragma once

#include "stability/effects/effect.h"

namespace swarmcert::stability {

class ConstantForce : public Effect {
 public:
  ConstantForce() : Effect(describe()) {}
  static EffectInfo describe();
  void columns(const Instant& now, const double* shape, Wrench* columns) const override;
};

}  // namespace swarmcert::stability
