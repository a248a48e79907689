/// @file Thrust lost to the flow that a climb sends through the rotors: f = -k T (b3' v) b3.
#pragma once

#include "stability/effects/effect.h"

namespace swarmcert::stability {

class Inflow : public Effect {
 public:
  Inflow() : Effect(describe()) {}
  static EffectInfo describe();
  void columns(const Instant& now, const double* shape, Wrench* columns) const override;
  bool in_support(const Instant& now, const double* shape) const override;
};

}  // namespace swarmcert::stability
