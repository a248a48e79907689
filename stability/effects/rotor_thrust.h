/// @file Rotors that give another thrust than the model's map says: a weak, worn or cut propeller, a tired motor.
#pragma once

#include "stability/effects/effect.h"

namespace swarmcert::stability {

/// f = sum_k (rotor_k - 1) f_k b3 with the torques of these forces, where f_k is what the model knows of rotor k: front
/// right, back right, back left, front left. The coefficient `model` takes the model's own thrust out, so that the
/// others are factors.
class RotorThrust : public Effect {
 public:
  RotorThrust() : Effect(describe()) {}
  static EffectInfo describe();
  void columns(const Instant& now, const double* shape, Wrench* columns) const override;
};

}  // namespace swarmcert::stability
