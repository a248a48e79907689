/// @file Delayed command: f = c (T(t - d) - T) b3, and torque likewise.
#pragma once

#include "stability/effects/memory_effect.h"

namespace swarmcert::stability {

class Delay : public MemoryEffect {
 public:
  Delay() : MemoryEffect(describe()) {}
  static EffectInfo describe();
  std::unique_ptr<ColumnStream> stream(const double* shape) const override;
  void add_to(SignalPath& path, const double* coefficients, const double* shape) const override;
};

}  // namespace swarmcert::stability
