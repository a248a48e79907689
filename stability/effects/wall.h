/// @file A wall at the edge of the room: f = p T exp(-d / b) n.
#pragma once

#include "stability/effects/effect.h"

namespace swarmcert::stability {

class Wall : public Effect {
 public:
  Wall() : Effect(describe()) {}
  static EffectInfo describe();
  void columns(const Instant& now, const double* shape, Wrench* columns) const override;
  bool in_support(const Instant& now, const double* shape) const override;
};

}  // namespace swarmcert::stability
