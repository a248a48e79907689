/// @file Thrust gained in horizontal flight: f = a T (1 - exp(-(v_h / v_0)^2)) b3.
#pragma once

#include "stability/effects/effect.h"

namespace swarmcert::stability {

class TranslationalLift : public Effect {
 public:
  TranslationalLift() : Effect(describe()) {}
  static EffectInfo describe();
  void columns(const Instant& now, const double* shape, Wrench* columns) const override;
  bool in_support(const Instant& now, const double* shape) const override;
};

}  // namespace swarmcert::stability
