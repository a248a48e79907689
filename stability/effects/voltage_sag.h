/// @file Thrust that is missing because the supply gives way under load: f = -s T ((T / W)^(3/2) - 1) b3.
#pragma once

#include "stability/effects/effect.h"

namespace swarmcert::stability {

class VoltageSag : public Effect {
 public:
  VoltageSag() : Effect(describe()) {}
  static EffectInfo describe();
  void columns(const Instant& now, const double* shape, Wrench* columns) const override;
  bool in_support(const Instant& now, const double* shape) const override;
};

}  // namespace swarmcert::stability
