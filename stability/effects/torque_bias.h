/// @file A constant torque: centre of gravity beside the thrust axis, unequal rotors.
#pragma once

#include "stability/effects/effect.h"

namespace swarmcert::stability {

class TorqueBias : public Effect {
 public:
  TorqueBias() : Effect(describe()) {}
  static EffectInfo describe();
  void columns(const Instant& now, const double* shape, Wrench* columns) const override;
};

}  // namespace swarmcert::stability
