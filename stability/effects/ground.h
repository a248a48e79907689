/// @file Ground effect: f = a T exp(-(z - z0) / b) b3.
#pragma once

#include "stability/effects/effect.h"

namespace swarmcert::stability {

class Ground : public Effect {
 public:
  Ground() : Effect(describe()) {}
  static EffectInfo describe();
  void columns(const Instant& now, const double* shape, Wrench* columns) const override;
  bool in_support(const Instant& now, const double* shape) const override;
};

}  // namespace swarmcert::stability
