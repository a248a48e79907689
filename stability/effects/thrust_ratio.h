/// @file Thrust scale, mass or payload: f = e T b3. Only the ratio of thrust to mass enters a flight's kinematics.
#pragma once

#include "stability/effects/effect.h"

namespace swarmcert::stability {

class ThrustRatio : public Effect {
 public:
  ThrustRatio() : Effect(describe()) {}
  static EffectInfo describe();
  void columns(const Instant& now, const double* shape, Wrench* columns) const override;
};

}  // namespace swarmcert::stability
