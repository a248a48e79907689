/// @file Wind that varies over the room: a shear layer over the height, and a column of rising or sinking air.
#pragma once

#include "stability/effects/effect.h"

namespace swarmcert::stability {

class WindField : public Effect {
 public:
  WindField() : Effect(describe()) {}
  static EffectInfo describe();
  void columns(const Instant& now, const double* shape, Wrench* columns) const override;
  bool in_support(const Instant& now, const double* shape) const override;
};

}  // namespace swarmcert::stability
