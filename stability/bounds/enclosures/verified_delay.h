/// @file Rigorous enclosures of the norms of an impulse response with a delay. Not for users.
#pragma once

#include <optional>

#include "stability/bounds/enclosures/verified_norms.h"

namespace swarmcert::stability {

/// Method of steps, verified afterwards. With x = (z, z', ..., z^(n-1)) in units of a rate, z = L^-1[1/D],
/// D = denominator + feedback e^(-Ts), the loop is x' = A x + B x(t - T); X is its fundamental matrix. Each column is
/// approximated by polynomials on stretches of T/2^p, whose coefficients are doubles and count as exact, and by zero in
/// the end. Such an X^ solves the equation up to a residual: what the polynomials miss of it, their jumps between
/// stretches, and the cut at the end, all enclosed; R, a matrix of measures. X^ = X * (I + R), so where the columns of
/// R have total variations below rho < 1, X = X^ * (I - R + R * R - ...) decays (the loop is stable), |X| <= |X^|/(1 -
/// rho) and |X - X^| <= |X| rho, in the 1-norm and the sup norm. What is wanted of y = numerator z is integrated piece
/// by piece and widened by that.
/// @param y a delay above zero; an integral: the response to a step, else that to an impulse.
/// @returns nothing where rho is not below 1, or where it takes more pieces than that: a few hundred thousand take
/// seconds.
std::optional<VerifiedNorms> norms_by_steps(const TransferFunction& y, bool integrates, long most_pieces);

}  // namespace swarmcert::stability
