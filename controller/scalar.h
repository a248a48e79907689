/// @file Requirements on the scalar type of the control laws, used in flight, integration and error analysis.
///
/// float is used in flight and double in the integrator. A third type (controller/rounding/bounded.h, host only)
/// propagates bounds on their difference through the same operations. The laws use +, -, /, comparisons, and the
/// functions below; a user-defined type overloads them in its namespace. Every product is rounded before it is added to
/// a sum (nn/arithmetic.h), and each formula is evaluated in the order in which it is written, so that the bits are the
/// same on every machine.
#pragma once

#include <cmath>

#include "nn/arithmetic.h"

namespace swarmcert::controller {

/// Returns a b, rounded to the type's precision in any context.
template <typename Scalar>
[[gnu::always_inline]] inline Scalar product(Scalar a, Scalar b) {
  return nn::rounded(a * b);
}

/// Returns the square root of `x`, correctly rounded (IEEE 754); 0 for negative numbers, which here arise only from
/// rounding errors of squares.
template <typename Scalar>
inline Scalar square_root(Scalar x) {
  return x < Scalar(0) ? Scalar(0) : std::sqrt(x);
}

template <typename Scalar>
inline Scalar absolute(Scalar x) {
  return x < Scalar(0) ? -x : x;
}

/// Returns `x` clamped to [lower, upper]. NaN stays NaN.
template <typename Scalar>
inline Scalar clamp(Scalar x, Scalar lower, Scalar upper) {
  return x < lower ? lower : x > upper ? upper : x;
}

/// Returns max(x, 0). NaN stays NaN.
template <typename Scalar>
inline Scalar positive_part(Scalar x) {
  return x < Scalar(0) ? Scalar(0) : x;
}

using nn::is_finite;

}  // namespace swarmcert::controller
