/// @file A payload that is dropped or picked up: f = -g (m_before or m_after) e_z.
#pragma once

#include "stability/effects/effect.h"

namespace swarmcert::stability {

class PayloadStep : public Effect {
 public:
  PayloadStep() : Effect(describe()) {}
  static EffectInfo describe();
  void columns(const Instant& now, const double* shape, Wrench* columns) const override;
  bool in_support(const Instant& now, const double* shape) const override;
};

}  // namespace swarmcert::stability
