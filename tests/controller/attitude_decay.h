/// @file Proven decay rates of the attitude laws: derivations and bounds for their tests.
#pragma once

#include <algorithm>
#include <cmath>

namespace swarmcert::controller {

/// Smallest and largest principal moment of inertia.
struct InertiaRange {
  double smallest_kg_m2, largest_kg_m2;
};

/// Decay of the error under lee_torque(): Psi(t) <= initial e^(-rate t) with Psi = 1 - cos(theta).
struct LeeDecay {
  bool applies = false;  ///< false: too close to a rotation by pi, or rotating too fast
  double initial = 0.0;
  double rate_1_s = 0.0;
};

/// Computes the decay for equal k_R in all axes and the smallest and largest entry w_min, w_max of K_omega.
///
/// Derivation (after Lee, Leok and McClamroch 2010, proposition 1, with j, J the extreme moments of inertia): the law
/// gives J e_w' = -k e_R - W e_w, and Psi' = e_R . e_w. Hence k Psi + e_w.J e_w / 2 does not increase, and Psi stays at
/// or below psi = Psi(0) + J |e_w(0)|^2 / (2 k); psi < 2 is required. There |e_R|^2 = Psi (2 - Psi) gives |e_R|^2 / 2
/// <= Psi <= |e_R|^2 / (2 - psi). Let V = k Psi + e_w.J e_w / 2 + c e_R.e_w. Since |e_R'| <= |e_w|,
///    V  <= [k / (2 - psi)] r^2 + c r w + (J / 2) w^2,               r = |e_R|, w = |e_w|,
///    V' <= -(c k / J) r^2 + (c w_max / j) r w - (w_min - c) w^2,
///    V  >= (k - c^2 / j) Psi, from r^2 <= 2 Psi and completing the square.
/// Hence V' <= -b V for every b for which b times the first quadratic form is at most the negative of the second. For
/// each c on a grid, b is found by bisection; the best c is used.
inline LeeDecay lee_decay(double k_R_N_m, double w_min, double w_max, const InertiaRange& inertia,
                          double angle_rad, double rate_error_rad_s) {
  const double j = inertia.smallest_kg_m2, big_j = inertia.largest_kg_m2, k = k_R_N_m;
  const double psi_0 = 1.0 - std::cos(angle_rad);
  const double psi = psi_0 + 0.5 * big_j * rate_error_rad_s * rate_error_rad_s / k;
  LeeDecay best;
  if (!(psi < 2.0)) return best;
  constexpr int kSteps = 400;
  const double c_end = std::min(w_min, std::sqrt(k * j));
  for (int i = 1; i < kSteps; ++i) {
    const double c = c_end * i / kSteps;
    const auto decays_at = [&](double b) {
      const double rr = c * k / big_j - b * k / (2.0 - psi);
      const double rw = c * w_max / j + b * c;  // the unfavourable sign
      const double ww = w_min - c - 0.5 * b * big_j;
      return rr >= 0.0 && ww >= 0.0 && 4.0 * rr * ww >= rw * rw;
    };
    if (!decays_at(0.0)) continue;
    double low = 0.0, high = c * (2.0 - psi) / big_j;
    for (int n = 0; n < 60; ++n) {
      const double middle = 0.5 * (low + high);
      (decays_at(middle) ? low : high) = middle;
    }
    if (low <= best.rate_1_s) continue;
    const double v_0 = k * psi_0 + 0.5 * big_j * rate_error_rad_s * rate_error_rad_s +
                       c * std::abs(std::sin(angle_rad)) * rate_error_rad_s;
    best = {true, v_0 / (k - c * c / j), low};
  }
  return best;
}

/// Returns a bound on |sigma(t)| = tan(theta / 4) under robust_torque() without integral action.
///
/// With q = omega - omega_r the law gives J q' = (J omega) x q - K_omega q. The first term does no work on q, so q.J q
/// decays at least at rate 2 k / J (k the smallest entry of K_omega, j and J the extreme moments of inertia): hence
/// |q(t)| <= sqrt(J / j) |q(0)| e^(-k t / J). For the attitude, omega_e = q - 4 Lambda sigma, and |sigma|' = (1 +
/// |sigma|^2) / 4 (sigma / |sigma|) . omega_e <= -l |sigma| + |q| / 2 with l the smallest entry of Lambda, because
/// |sigma| <= 1. At a rotation by pi, sigma changes sign and keeps its norm. Hence, everywhere on SO(3),
///    |sigma(t)| <= e^(-l t) |sigma(0)| + sqrt(J / j) |q(0)| / 2 * integral_0^t e^(-l (t - u)) e^(-k u / J) du.
inline double robust_decay(double lambda_1_s, double k_omega_N_m_s, const InertiaRange& inertia,
                           double sigma_0, double rate_error_0_rad_s, double time_s) {
  const double a = k_omega_N_m_s / inertia.largest_kg_m2, l = lambda_1_s;
  const double start = std::sqrt(inertia.largest_kg_m2 / inertia.smallest_kg_m2) * rate_error_0_rad_s / 2.0;
  // (e^(-a t) - e^(-l t)) / (l - a), written without cancellation for nearly equal rates.
  const double gap = (l - a) * time_s;
  const double convolution =
      gap == 0.0 ? time_s * std::exp(-l * time_s) : time_s * std::exp(-l * time_s) * std::expm1(gap) / gap;
  return std::exp(-l * time_s) * sigma_0 + start * convolution;
}

}  // namespace swarmcert::controller
