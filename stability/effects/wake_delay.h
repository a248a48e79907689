/// @file Downwash that takes time to arrive, and drifts with the wind meanwhile.
#pragma once

#include "stability/effects/downwash.h"

namespace swarmcert::stability {

/// The wake of downwash.h, of neighbours where they were delay_s ago, carried along by a horizontal wind w since: as if
/// they were at p_j + delay_s (w - v_j), their velocity taken as constant meanwhile. With a delay of 0 it is the
/// downwash without convection.
class WakeDelay : public Effect {
 public:
  WakeDelay() : Effect(describe()) {}
  static EffectInfo describe();
  void columns(const Instant& now, const double* shape, Wrench* columns) const override;
  bool in_support(const Instant& now, const double* shape) const override;
  std::vector<std::vector<double>> grid(const FlightRange& range) const override;

 private:
  Downwash wake_;
};

}  // namespace swarmcert::stability
