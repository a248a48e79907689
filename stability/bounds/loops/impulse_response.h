/// @file Impulse responses of linear loops and their exact norms, the worst-case gains of bounded disturbances.
///
/// For e = h * w (convolution, from rest), |e(t)| <= |h|_1 sup|w|, which the sign pattern w(t - u) = sign h(u) attains;
/// |e(t)| <= sup|h| int|w|. These norms are therefore the exact gains, not estimates (Hoelder).
#pragma once

#include <complex>
#include <vector>

#include "stability/bounds/loops/polynomial.h"

namespace swarmcert::stability {

/// Y(s) = numerator(s) / (denominator(s) + feedback(s) exp(-delay_s s)), strictly proper.
struct TransferFunction {
  Polynomial numerator;
  Polynomial denominator;
  Polynomial feedback = {};  ///< of lower degree than the denominator; empty without a delay
  double delay_s = 0;
};

/// Norms of y(t) = L^-1[Y], t > 0. Computed between the zeros of y, y' and y'', which are bracketed and refined to
/// round-off; no sums over a grid. Relative error about 1e-12 without a delay, 1e-11 with one; not rigorous (for
/// enclosures see verified_norms.h). All infinite if the loop is unstable.
struct ResponseNorms {
  double integral = 0;            ///< int y
  double integral_abs = 0;        ///< |y|_1
  double max = 0;                 ///< sup y (at least 0)
  double min = 0;                 ///< inf y (at most 0)
  double step_max_abs = 0;        ///< sup |int_0^t y|
  double variation = 0;           ///< |y'|_1 over t > 0, without a jump at 0
  double slope_max_abs = 0;       ///< |y'|_oo
  double curvature_integral = 0;  ///< |y''|_1 over t > 0, without jumps at 0

  double max_abs() const { return max > -min ? max : -min; }
};

ResponseNorms response_norms(const TransferFunction& y);

/// Returns `count` values y(0), y(step), ..., by the exact recursion of the state (without a delay) or by Taylor
/// segments.
std::vector<double> sampled_response(const TransferFunction& y, double step_s, int count);

/// Returns the poles, the zeros of the denominator, for a system without a delay.
std::vector<std::complex<double>> poles(const Polynomial& denominator);

/// Returns true if all zeros of denominator + feedback exp(-delay s) have negative real parts. With a delay: if the
/// loop without delay is stable and the delay is below delay_margin().
bool is_stable(const TransferFunction& y);

/// Returns the largest T such that denominator + feedback exp(-s t) has all zeros in the open left half-plane for every
/// delay t in [0, T): the least arg(...)/w over the frequencies w with |denominator(jw)| = |feedback(jw)|. Infinite if
/// there is no such frequency. 0 if the loop is unstable without a delay.
double delay_margin(const Polynomial& denominator, const Polynomial& feedback);

}  // namespace swarmcert::stability
