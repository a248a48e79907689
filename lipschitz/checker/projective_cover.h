/// @file All of R^n as finitely many bounded boxes, so that a proof on boxes bounds the slope everywhere. Not for
/// users.
#pragma once

#include "lipschitz/checker/tree_proof.h"

namespace swarmcert::check {

/// f as a function of (u, s), s >= 0: y = W h + b s in every layer, which is positively homogeneous, so that the
/// neurons at (u, s) with s > 0 are as those of f at x = u / s, and df/dx there is the derivative in u. s is the last
/// input and the last output of every hidden layer but the last one; it never moves.
LocalFunction homogeneous(const LocalFunction& f);

/// Boxes of (u, s) such that every x is u / s for a point of one: [-r, r] with s = 1, for |x_k| <= r_k; and for each k
/// the faces u_k = -r_k and u_k = r_k of [-r, r], with 0 <= s <= 1: x beyond, with s = min_k r_k / |x_k|.
std::vector<Sides> projective_cover(const std::vector<double>& radius);

}  // namespace swarmcert::check
