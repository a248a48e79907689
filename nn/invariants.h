/// @file Rotation invariants: relative states without their direction about the vertical.
///
/// A vertical force does not change when the neighbours are rotated about the vertical or mirrored in a vertical plane.
/// A network that takes invariants instead of a neighbour's state (p, v) has that symmetry exactly:
///   J(p, v) = (|p_xy|, 3/2 p_z, |v_xy|, 3/2 v_z, |p_xy + 1/2 s v_xy|),   K(-z, -v) = (-z, |v_xy|, -v_z),
/// with J for neighbours, in m and m/s, and K for the vehicle's own state. The five components of J determine |p_xy|,
/// v_xy| and the product p_xy . v_xy, hence (p, v) up to a rotation and a reflection; no other information is lost.
///
/// The Lipschitz constants in Euclidean norms are 3/2 for J and 1 for K; both are attained. Proof for J: a norm changes
/// by at most the norm of the change. With a = |dp_xy| and b = |dv_xy|, the squared changes of the three norms sum to
/// at most
///   a^2 + b^2 + (a + b / 2)^2 = (a, b) G (a, b)',   G = I + (1, 1/2)' (1, 1/2),
/// and the eigenvalues of G are 1 and 1 + 1 + 1/4 = (3/2)^2. The vertical components are scaled by 3/2, which does not
/// increase the constant that the horizontal ones already require.
#pragma once

#include "nn/arithmetic.h"

namespace swarmcert::nn {

/// Components of a neighbour's relative state: p_x, p_y, p_z in m, v_x, v_y, v_z in m/s.
inline constexpr int kRelativeState = 6;
/// Components of the vehicle's own state: -z in m, -v_x, -v_y, -v_z in m/s.
inline constexpr int kOwnState = 4;
inline constexpr int kNeighbourInvariants = 5;
inline constexpr int kOwnInvariants = 3;
/// Exact Lipschitz constants of J and K.
inline constexpr double kNeighbourInvariantsSlope = 1.5;
inline constexpr double kOwnInvariantsSlope = 1;

/// Returns the correctly rounded square root (IEEE 754) in one instruction; std::sqrt() may call libm to set errno.
/// Precondition: x is not negative.
inline float square_root(float x) {
#if defined(__SSE2__)
  asm("sqrtss %1, %0" : "=x"(x) : "x"(x));
  return x;
#elif defined(__aarch64__)
  asm("fsqrt %s0, %s1" : "=w"(x) : "w"(x));
  return x;
#elif defined(__arm__) && defined(__ARM_FP) && (__ARM_FP & 4)
  asm("vsqrt.f32 %0, %1" : "=t"(x) : "t"(x));
  return x;
#else
  return __builtin_sqrtf(x);
#endif
}

inline double square_root(double x) {
#if defined(__SSE2__)
  asm("sqrtsd %1, %0" : "=x"(x) : "x"(x));
  return x;
#else
  return __builtin_sqrt(x);
#endif
}

/// Returns |(x, y)|, or infinity if a square overflows.
template <typename Scalar>
inline Scalar horizontal_norm(Scalar x, Scalar y) {
  return square_root(rounded(x * x) + rounded(y * y));
}

/// Computes J as defined at the top of this file.
/// @param state [kRelativeState].
/// @param invariants [kNeighbourInvariants].
template <typename Scalar>
inline void neighbour_invariants(const Scalar* state, Scalar* invariants) {
  const Scalar half(0.5), vertical(1.5);
  const Scalar *const p = state, *const v = state + 3;
  invariants[0] = horizontal_norm(p[0], p[1]);
  invariants[1] = rounded(vertical * p[2]);
  invariants[2] = horizontal_norm(v[0], v[1]);
  invariants[3] = rounded(vertical * v[2]);
  invariants[4] = horizontal_norm(p[0] + rounded(half * v[0]), p[1] + rounded(half * v[1]));
}

/// Computes K as defined at the top of this file.
/// @param state [kOwnState].
/// @param invariants [kOwnInvariants].
template <typename Scalar>
inline void own_invariants(const Scalar* state, Scalar* invariants) {
  invariants[0] = state[0];
  invariants[1] = horizontal_norm(state[1], state[2]);
  invariants[2] = state[3];
}

}  // namespace swarmcert::nn
