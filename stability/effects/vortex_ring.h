/// @file Thrust lost in the vehicle's own wake as it descends: f = -a T exp(-((v_c + v_0) / w)^2 / 2) b3.
#pragma once

#include "stability/effects/effect.h"

namespace swarmcert::stability {

class VortexRing : public Effect {
 public:
  VortexRing() : Effect(describe()) {}
  static EffectInfo describe();
  void columns(const Instant& now, const double* shape, Wrench* columns) const override;
  bool in_support(const Instant& now, const double* shape) const override;
};

}  // namespace swarmcert::stability
