/// @file A load that hangs on a string below the centre of mass.
#pragma once

#include "stability/effects/state_effect.h"

namespace swarmcert::stability {

/// A mass point on a taut string of length l, at any angle, with friction d against its swing. With r the place of the
/// load relative to the vehicle, n = r / l and a the vehicle's acceleration:
///   r'' = g - a - d r' - T n,   T = n (g - a - d r') + |r'|^2 / l,   f = m_l (T n + d r').
/// For small angles that is u'' = -(g / l) u - d u' - a of the horizontal place u, and
/// f = m_l ((g / l) u + d u', -(g + a_z)). A string that goes slack is not modelled.
/// States: r - (0, 0, -l) and r'.
class Pendulum : public StateEffect {
 public:
  Pendulum() : StateEffect(describe()) {}
  static EffectInfo describe();
  /// The weight of the load that hangs still.
  void columns(const Instant& now, const double* shape, Wrench* columns) const override;
  /// The swing follows from the logged velocity, from rest at the start and after every gap; in the tension, the
  /// acceleration is the derivative of the logged velocity behind a low-pass of 0.04 s.
  std::unique_ptr<ColumnStream> stream(const double* shape) const override;
  bool in_support(const Instant& now, const double* shape) const override;
  /// Damped resonances that overlap, from the shortest string to the longest.
  std::vector<std::vector<double>> grid(const FlightRange& range) const override;
  int num_states() const override { return 6; }
  Wrench act(const Instant& now, const Eigen::Vector3d& others_W_N, const double* coefficients,
             const double* shape, const double* states, double* rates) const override;
};

}  // namespace swarmcert::stability
