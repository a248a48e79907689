/// @file Proofs of Lipschitz bounds on a box, part by part, for any activations that act entry by entry.
#pragma once

#include <string>
#include <vector>

#include "lipschitz/checker/tree_proof.h"
#include "nn/weights/network.h"

namespace swarmcert::check {

/// Returns whether the tree proves |f(x) - f(y)|^2 <= rho |x - y|^2 for all x, y of the box that differ in `block`, in
/// units of `scale`; f as in chain_on_box(). Its words are splits and leaves (TreeProof).
///
/// The segment from x to y is cut where it crosses from one part to another, and the increments of the pieces, which
/// are parallel, add up. Between two points of a part, lipschitz_lmi() of chain_on_box() of the part bounds the slope:
/// a leaf holds if that matrix is positive semidefinite for rho and the leaf's multipliers, in exact arithmetic.
/// @param box range of the moving input after the clamp.
TreeVerdict check_slope_tree(const files::Network& network, const files::FunctionId& function,
                             const std::string& block, const std::vector<double>& scale, const Sides& box,
                             double rho, const TreeProof& proof);

}  // namespace swarmcert::check
