/// @file A linear system in coordinates in which it is verified to contract. Not for users.
#pragma once

#include <array>
#include <optional>

#include "stability/bounds/enclosures/interval_matrix.h"
#include "stability/bounds/loops/impulse_response.h"

namespace swarmcert::stability {

/// y(t) = row exp(At) b, with its antiderivative and derivatives, in contracting coordinates.
struct ContractingSystem {
  IntervalMatrix A;
  IntervalVector b;
  double alpha = 0;
  /// Rows that give Y (the antiderivative of y that vanishes at infinity), y, y', y''.
  std::array<IntervalVector, 4> rows;
};

/// Changes the companion form to coordinates R x, with R'R the solution of a Lyapunov equation. The symmetric part of
/// the system matrix in these coordinates is verified to lie below -alpha I (interval Cholesky), so
/// |exp(A t)|_2 <= e^(-alpha t). Valid for every transfer function with coefficients in the given intervals. Returns
/// nothing if stability could not be verified.
/// @param numerator   in ascending powers, of lower degree than the denominator.
/// @param denominator in ascending powers; the leading coefficient does not contain zero.
std::optional<ContractingSystem> contracting(const IntervalVector& numerator,
                                             const IntervalVector& denominator);

}  // namespace swarmcert::stability
