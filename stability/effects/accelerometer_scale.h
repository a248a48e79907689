/// @file An accelerometer that reads too much or too little.
#pragma once

#include "stability/effects/memory_effect.h"

namespace swarmcert::stability {

/// The log's specific force is `scale` times the true one. As a force, to first order in what is no thrust: (scale - 1)
/// T b3. In simulation it acts on the log alone.
class AccelerometerScale : public MemoryEffect {
 public:
  AccelerometerScale() : MemoryEffect(describe()) {}
  static EffectInfo describe();
  std::unique_ptr<ColumnStream> stream(const double* shape) const override;
  void add_to(SignalPath& path, const double* coefficients, const double* shape) const override;
};

}  // namespace swarmcert::stability
