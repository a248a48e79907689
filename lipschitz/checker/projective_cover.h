/// @file A cover of R^n by finitely many bounded boxes, so that a proof on boxes bounds the slope for all inputs. Not
/// for users.
#pragma once

#include "lipschitz/checker/tree_proof.h"

namespace swarmcert::check {

/// Returns f as a function of (u, s), s >= 0, with y = W h + b s in every layer. This function is positively
/// homogeneous, so that for s > 0 the neurons at (u, s) have the same states as those of f at x = u / s, and df/dx
/// there is the derivative with respect to u. s is the last input and the last output of every hidden layer but the
/// last one; it never moves.
LocalFunction homogeneous(const LocalFunction& f);

/// Returns boxes of (u, s) such that every x equals u / s for a point of one of them: [-r, r] with s = 1 for
/// |x_k| <= r_k; and for each k the faces u_k = -r_k and u_k = r_k of [-r, r] with 0 <= s <= 1 for all other x, with
/// s = min_k r_k / |x_k|.
std::vector<Sides> projective_cover(const std::vector<double>& radius);

}  // namespace swarmcert::check
