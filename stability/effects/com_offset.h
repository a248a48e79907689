/// @file A centre of mass beside the centre of the rotors.
#pragma once

#include "stability/effects/effect.h"

namespace swarmcert::stability {

/// tau = -c x T e3 = T (-c_y, c_x, 0) in the body, c the place of the centre of mass from the centre of the rotors. A
/// height of the centre of mass adds nothing to the torque of forces along e3.
class ComOffset : public Effect {
 public:
  ComOffset() : Effect(describe()) {}
  static EffectInfo describe();
  void columns(const Instant& now, const double* shape, Wrench* columns) const override;
};

}  // namespace swarmcert::stability
