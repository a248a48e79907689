/// @file Rotors follow their command like a first-order lag: tau x' = u - x, f = c (x - T) b3 and torque likewise.
#pragma once

#include "stability/effects/memory_effect.h"

namespace swarmcert::stability {

class MotorLag : public MemoryEffect {
 public:
  MotorLag() : MemoryEffect(describe()) {}
  static EffectInfo describe();
  std::unique_ptr<ColumnStream> stream(const double* shape) const override;
  void add_to(SignalPath& path, const double* coefficients, const double* shape) const override;
};

}  // namespace swarmcert::stability
