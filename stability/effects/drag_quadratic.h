/// @file Drag of the body at speed: f = -c |v| v.
#pragma once

#include "stability/effects/effect.h"

namespace swarmcert::stability {

class DragQuadratic : public Effect {
 public:
  DragQuadratic() : Effect(describe()) {}
  static EffectInfo describe();
  void columns(const Instant& now, const double* shape, Wrench* columns) const override;
  bool in_support(const Instant& now, const double* shape) const override;
};

}  // namespace swarmcert::stability
