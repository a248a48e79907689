/// @file Downwash of the vehicles above, composed by a p-norm.
///
/// One neighbour j of mass m_j, higher by dz_j, contributes per newton of amplitude
///   g_j = (m_j / 0.034 kg)^e (0.3 / dz)^n (1 + q x)^(-1/q) u(dz),   x = |r_j|^2 / (2 s^2),   s = s0 + s1 dz.
/// For q = 0 the profile is the Gaussian exp(-x); q = 1 is Lorentzian, with the far tail of a turbulent jet. r_j is the
/// horizontal distance from the neighbour's wake: the wake of a moving vehicle lags behind it by k dz v_j. Below 0.12 m
/// dz is replaced by 0.12 m, and u fades the force out from there to 0.05 m, where vehicles touch. The total is
///   f_z = -A (sum_j g_j^p)^(1/p).
/// The defaults are a fit to two-vehicle flights of small Crazyflies with 0.15 <= dz <= 0.75 m, residual 1.1 gf rms.
/// p = 1 is a plain sum, p = 2 adds momentum flux; flights of three vehicles gave 1.85, tracking errors of up to five
/// vehicles 1.2 .. 1.3.
#pragma once

#include "stability/effects/effect.h"

namespace swarmcert::stability {

/// Wakes that arrive `delay_s` after they left the rotors and are carried along by a wind w: the neighbours act as if
/// they were at p_j + delay_s (w - v_j), assuming that their velocity is constant during the delay.
struct WakeDrift {
  double delay_s = 0;
  Eigen::Vector3d wind_m_s = Eigen::Vector3d::Zero();  ///< w

  Eigen::Vector3d dp_W_m(const Neighbour& neighbour) const {
    if (delay_s == 0) return neighbour.dp_W_m;
    return neighbour.dp_W_m + delay_s * (wind_m_s - neighbour.v_W_m_s);
  }
};

class Downwash : public Effect {
 public:
  /// Indices into theta.
  enum Shape { kDecay, kSpread0, kSpreadSlope, kNorm, kConvection, kMassExponent, kTail };

  Downwash() : Effect(describe()) {}
  static EffectInfo describe();
  void columns(const Instant& now, const double* shape, Wrench* columns) const override;
  void columns_along(const Instant* instants, int count, const double* shape, Wrench* columns) const override;
  /// columns_along() for drifting wakes.
  void drifted_columns(const Instant* instants, int count, const double* shape, const WakeDrift& drift,
                       Wrench* columns) const;
  bool takes_pairs() const override { return true; }
  bool pairs_need_velocity(const double* shape) const override { return shape[kConvection] != 0; }
  /// Returns the logarithm of the part of g^p that depends on neither position nor motion.
  double pair_constant(double neighbour_mass_kg, const double* shape) const override;
  void add_force_z(const SwarmPairs& pairs, const double* const* states, int num_states, const double* shape,
                   double coefficient, double* scratch, const ForceRows& forces) const override;
  bool in_support(const Instant& now, const double* shape) const override;
  std::vector<std::vector<double>> grid(const FlightRange& range) const override;
  double reach_m(double dz_m, const double* shape) const override;
  std::vector<double> bends_m() const override;
};

}  // namespace swarmcert::stability
