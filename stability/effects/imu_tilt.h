/// @file An inertial unit that is tilted against the rotors: the log's attitude is that of the unit.
#pragma once

#include "stability/effects/effect.h"

namespace swarmcert::stability {

/// f = T R (t x e3), t = (tilt_x, tilt_y, 0): the rotors push along R (e3 + t x e3), to first order in t. In simulation
/// the attitude is that of the unit, so that it is the rotors that are tilted.
class ImuTilt : public Effect {
 public:
  ImuTilt() : Effect(describe()) {}
  static EffectInfo describe();
  void columns(const Instant& now, const double* shape, Wrench* columns) const override;
};

}  // namespace swarmcert::stability
