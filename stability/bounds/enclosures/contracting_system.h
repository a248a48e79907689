/// @file A linear system in coordinates in which it verifiably contracts. Not for users.
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
  /// Rows that give Y (int y, vanishing at infinity), y, y', y''.
  std::array<IntervalVector, 4> rows;
};

/// Coordinates R x of the companion form, R'R the solution of a Lyapunov equation; the symmetric part of the system's
/// matrix there is verified to lie below -alpha I (interval Cholesky), so |exp(A t)|_2 <= e^(-alpha t).
/// Nothing where stability could not be verified, for every transfer function with such coefficients.
/// @param numerator   in ascending powers, of lower degree than the denominator.
/// @param denominator in ascending powers; its last does not contain zero.
std::optional<ContractingSystem> contracting(const IntervalVector& numerator,
                                             const IntervalVector& denominator);
/// The same of a transfer function without a delay.
std::optional<ContractingSystem> contracting(const TransferFunction& h);

}  // namespace swarmcert::stability
