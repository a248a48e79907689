/// @file A load suspended on a string from the centre of mass.
#pragma once

#include "stability/effects/state_effect.h"

namespace swarmcert::stability {

/// A point mass on a taut string of length l, at any angle, with damping d of its swing. With r the position of the
/// load relative to the vehicle, n = r / l and a the vehicle's acceleration:
///   r'' = g - a - d r' - T n,   T = n (g - a - d r') + |r'|^2 / l,   f = m_l (T n + d r').
/// For small angles this is u'' = -(g / l) u - d u' - a for the horizontal displacement u, and
/// f = m_l ((g / l) u + d u', -(g + a_z)). Slack strings are not modelled.
/// States: r - (0, 0, -l) and r'.
class Pendulum : public StateEffect {
 public:
  Pendulum() : StateEffect(describe()) {}
  static EffectInfo describe();
  /// The weight of the load hanging at rest.
  void columns(const Instant& now, const double* shape, Wrench* columns) const override;
  /// The swing is computed from the logged velocity, starting at rest at the start and after every gap. In the tension,
  /// the acceleration is the derivative of the logged velocity behind a low-pass of 0.04 s.
  std::unique_ptr<ColumnStream> stream(const double* shape) const override;
  bool in_support(const Instant& now, const double* shape) const override;
  /// Overlapping damped resonances, from the shortest string to the longest.
  std::vector<std::vector<double>> grid(const FlightRange& range) const override;
  int num_states() const override { return 6; }
  Wrench act(const Instant& now, const Eigen::Vector3d& others_W_N, const double* coefficients,
             const double* shape, const double* states, double* rates) const override;
};

}  // namespace swarmcert::stability
