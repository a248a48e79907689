/// @file Thrust that is missing above a knee, because propellers saturate: f = -c max(0, T - k W) b3.
#pragma once

#include "stability/effects/effect.h"

namespace swarmcert::stability {

class ThrustSaturation : public Effect {
 public:
  ThrustSaturation() : Effect(describe()) {}
  static EffectInfo describe();
  void columns(const Instant& now, const double* shape, Wrench* columns) const override;
  bool in_support(const Instant& now, const double* shape) const override;
};

}  // namespace swarmcert::stability
