/// @file Rigorous enclosures of the norms of an impulse response with a delay. Not for users.
#pragma once

#include <optional>

#include "stability/bounds/enclosures/verified_norms.h"

namespace swarmcert::stability {

/// Computes the norms by the method of steps, verified a posteriori. With x = (z, z', ..., z^(n-1)) in units of a rate,
/// z = L^-1[1/D], D = denominator + feedback e^(-Ts), the loop is x' = A x + B x(t - T); X is its fundamental matrix.
/// Each column is approximated by polynomials on segments of T/2^p, whose coefficients are doubles and taken as exact,
/// and by zero beyond the last segment. This approximation X^ solves the equation up to a residual R, a matrix of
/// measures: the defects of the polynomials, their jumps between segments, and the truncation at the end, all enclosed.
/// X^ = X * (I + R); hence if the columns of R have total variations below rho < 1, X = X^ * (I - R + R * R - ...)
/// decays (the loop is stable), |X| <= |X^|/(1 - rho) and |X - X^| <= |X| rho, in the 1-norm and the sup norm. The
/// norms of y = numerator z are integrated segment by segment and widened accordingly.
/// @param y with a positive delay.
/// @param integrates true: the response to a step; false: that to an impulse.
/// @param most_pieces limit on the number of segments; a few hundred thousand take seconds.
/// @returns nothing if rho is not below 1, or if more than `most_pieces` segments are needed.
std::optional<VerifiedNorms> norms_by_steps(const TransferFunction& y, bool integrates, long most_pieces);

}  // namespace swarmcert::stability
