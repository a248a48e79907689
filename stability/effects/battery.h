/// @file Thrust that the map misses as the battery drains: f = k (V - 4.2 V) T b3.
#pragma once

#include "stability/effects/effect.h"

namespace swarmcert::stability {

class Battery : public Effect {
 public:
  Battery() : Effect(describe()) {}
  static EffectInfo describe();
  void columns(const Instant& now, const double* shape, Wrench* columns) const override;
  bool in_support(const Instant& now, const double* shape) const override;
};

}  // namespace swarmcert::stability
