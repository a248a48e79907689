/// @file Delayed accelerometer: the log shows c ((T b3)(t - d) - T b3) as a force.
#pragma once

#include "stability/effects/memory_effect.h"

namespace swarmcert::stability {

class SensorDelay : public MemoryEffect {
 public:
  SensorDelay() : MemoryEffect(describe()) {}
  static EffectInfo describe();
  std::unique_ptr<ColumnStream> stream(const double* shape) const override;
  void add_to(SignalPath& path, const double* coefficients, const double* shape) const override;
};

}  // namespace swarmcert::stability
