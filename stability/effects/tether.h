/// @file A line to an anchor that pulls once it is taut.
#pragma once

#include "stability/effects/effect.h"

namespace swarmcert::stability {

/// f = -k max(0, |p - a| - l) (p - a) / |p - a|, a the anchor and l the slack length.
class Tether : public Effect {
 public:
  Tether() : Effect(describe()) {}
  static EffectInfo describe();
  void columns(const Instant& now, const double* shape, Wrench* columns) const override;
  bool in_support(const Instant& now, const double* shape) const override;
};

}  // namespace swarmcert::stability
