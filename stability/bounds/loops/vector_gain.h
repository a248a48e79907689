/// @file The exact gain of the theorem's loop from a 3D disturbance rate to a 3D tracking error.
#pragma once

#include <array>

#include "stability/gains.h"

namespace swarmcert::stability {

/// G = sup of |e(T)|_2 over all T and all |eps'(t)|_2 <= 1 N/s, in m per N/s, for m s'' + K s' = -eps',
/// s' = (D + Lambda)^2 e. With the impulse response H(t) [3 x 3], G = max over directions eta of
/// J(eta) = int |H(t)' eta| dt.
struct VectorGain {
  double lower = 0;                   ///< error attained by replaying the worst input
  double upper = 0;                   ///< no admissible input exceeds it
  std::array<double, 3> direction{};  ///< eta of the worst input, a unit vector
  /// Returns true if upper - lower < 1e-6; the gain is then called exact.
  bool is_exact() const { return upper - lower < 1e-6; }
};

/// Lower bound: the input -C'eta/|C'eta| on each cell of a fine partition, with C the cell's integral of H, is
/// admissible, and its response is the sum of |C'eta|. Upper bound: the trapezoidal sum of |H'eta| plus its remainder,
/// made uniform in eta by
///  - concavity: sqrt(x) <= (x/w + w)/2 with w = |H'eta*| gives J(eta) <= (int w + eta' (int H H'/w) eta)/2 for every
///    eta, an eigenvalue problem; this closes the gap whenever Lambda and K commute;
///  - covering the sphere by triangles, refined where the bound is largest: J is convex and homogeneous, so on the cone
///    of a triangle it lies below the linear function through its corners.
/// Valid up to the round-off error of evaluating the response (1e-12 relative).
/// @param Lambda, K symmetric positive definite.
VectorGain vector_peak_gain(const Matrix3& Lambda, const Matrix3& K, double mass_kg);

}  // namespace swarmcert::stability
