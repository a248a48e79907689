/// @file Requirements on the scalar type of the control laws, which serve flight, integration and error analysis.
///
/// float flies; double serves the integrator; a third type (controller/rounding/bounded.h, host only) carries bounds on
/// their difference through the same operations. The laws use +, -, /, comparisons, and the functions below; a type
/// of its own overloads them in its namespace. Every product is rounded before it enters a sum (nn/arithmetic.h), and
/// each formula is evaluated in the order in which it is written: the same bits on every machine.
#pragma once

#include <cmath>

#include "nn/arithmetic.h"

namespace swarmcert::controller {

/// a b, rounded to the type's precision whatever stands around it.
template <typename Scalar>
[[gnu::always_inline]] inline Scalar product(Scalar a, Scalar b) {
  return nn::rounded(a * b);
}

/// The root of `x`, correctly rounded (IEEE 754); 0 for negative numbers, which here are rounding errors of squares.
template <typename Scalar>
inline Scalar square_root(Scalar x) {
  return x < Scalar(0) ? Scalar(0) : std::sqrt(x);
}

template <typename Scalar>
inline Scalar absolute(Scalar x) {
  return x < Scalar(0) ? -x : x;
}

/// `x`, or the end of [lower, upper] that it passes. A NaN stays a NaN.
template <typename Scalar>
inline Scalar clamp(Scalar x, Scalar lower, Scalar upper) {
  return x < lower ? lower : x > upper ? upper : x;
}

/// max(x, 0). A NaN stays a NaN.
template <typename Scalar>
inline Scalar positive_part(Scalar x) {
  return x < Scalar(0) ? Scalar(0) : x;
}

using nn::is_finite;

}  // namespace swarmcert::controller
