/// @file Ceiling effect: f = a T exp(-(h - z) / b) b3, or with a tail that falls like a power.
#pragma once

#include "stability/effects/effect.h"

namespace swarmcert::stability {

class Ceiling : public Effect {
 public:
  Ceiling() : Effect(describe()) {}
  static EffectInfo describe();
  void columns(const Instant& now, const double* shape, Wrench* columns) const override;
  bool in_support(const Instant& now, const double* shape) const override;
  std::vector<std::vector<double>> grid(const FlightRange& range) const override;
};

}  // namespace swarmcert::stability
