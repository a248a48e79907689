/// @file The tracking theorem: its hypotheses, its error ball and its transient bound.
///
/// With s' = e'' + 2 Lambda e' + Lambda^2 e and force -K s, learning error eps0 + eps(t), |eps'| <= d_m:
///   limsup |e| <= d_m / (lambda_min(Lambda)^2 lambda_min(K)).
/// It is a limsup, not a limit. Proof: V = m |s'|^2 / 2 gives |s'(t)| <= e^(-at)|s'(0)| + d_m (1 - e^(-at)) / k with
/// k = lambda_min(K), a = k/m; two convolutions with exp(-Lambda t), of norm e^(-lt) for symmetric Lambda, give the
/// rest. Lambda and K need not commute. The bound can fail for a non-symmetric Lambda.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "controller/gain_conversion.h"
#include "stability/bounds/flown_loop.h"

namespace swarmcert::stability {

struct Theorem {
  bool applies = false;
  /// One sentence for each hypothesis that fails, with the numbers.
  std::vector<std::string> why_not;
  /// The gains in (Lambda, K) form, if they have one with symmetric positive definite matrices.
  std::optional<CompositeGains> composite;
  double min_Lambda = 0;  ///< lambda_min(Lambda), 1/s; valid if `composite` is set
  double min_K = 0;       ///< lambda_min(K), kg/s
  /// Returns the ball per unit of d_m, m per N/s, from `composite`; a bound for the loop only if `applies`.
  double ball_per_rate() const { return 1 / (min_Lambda * min_Lambda * min_K); }
};

/// Checks every hypothesis on the loop: each declared fact either satisfies it or is an objection. The theorem is about
/// the continuous loop; of a sampled one it requires that it is stable. Saturation is not judged here (saturation.h).
/// @param integrator_needs_m_s largest state demanded of the integrator in firmware, per axis, if known; a clamp above
///     it never acts and does not violate the hypotheses.
Theorem check_theorem(const FlownLoop& loop, const std::optional<PerAxis>& integrator_needs_m_s);

/// Returns the ball per unit of d_m of the loop that flies, m per N/s: an upper bound on sup |e| from rest over all
/// |eps'| <= 1 N/s, for all axes together; axes with equal loops count once. For a sampled loop it is that of its exact
/// rate gains, for a force or an error of the command. Nothing if Lambda or K couples the axes of a sampled loop, or if
/// the theorem does not apply.
std::optional<double> flown_ball_per_rate(const FlownLoop& loop, const Theorem& theorem);

/// The closed-form transient bound, valid for all t >= 0:
///   |e(t)| <= (1 + lt) e^(-lt) |e(0)| + t e^(-lt) |e'(0)| + m h(t) |s'(0)| + d_m int_0^t h.
/// s'(0) = e''(0) + 2 Lambda e'(0) + Lambda^2 e(0), and e''(0) contains the initial learning error divided by the mass.
struct Transient {
  double l = 0;  ///< lambda_min(Lambda), 1/s
  double k = 0;  ///< lambda_min(K), kg/s
  double mass_kg = 0;
  double error_m = 0, speed_m_s = 0, s_dot_m_s2 = 0;  ///< norms at t = 0
  double rate_N_s = 0;                                ///< d_m

  double at(double t_s) const;
  /// Returns the exponential rate of convergence, 1/s: min(k/m, l), up to a polynomial factor.
  double decay_1_s() const;
};

}  // namespace swarmcert::stability
