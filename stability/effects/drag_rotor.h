/// @file Drag of the rotors in their own plane, in proportion to thrust: f = -k (T / (m g)) (I - b3 b3') v.
#pragma once

#include "stability/effects/effect.h"

namespace swarmcert::stability {

class DragRotor : public Effect {
 public:
  DragRotor() : Effect(describe()) {}
  static EffectInfo describe();
  void columns(const Instant& now, const double* shape, Wrench* columns) const override;
  bool in_support(const Instant& now, const double* shape) const override;
};

}  // namespace swarmcert::stability
