/// @file Drag of the body: f = -D v.
#pragma once

#include "stability/effects/effect.h"

namespace swarmcert::stability {

class DragLinear : public Effect {
 public:
  DragLinear() : Effect(describe()) {}
  static EffectInfo describe();
  void columns(const Instant& now, const double* shape, Wrench* columns) const override;
  bool in_support(const Instant& now, const double* shape) const override;
};

}  // namespace swarmcert::stability
