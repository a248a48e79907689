/// @file A Lipschitz bound on a box, proved part by part.
#pragma once

#include <string>
#include <vector>

#include "lipschitz/checker/box_states.h"
#include "lipschitz/checker/dyadic.h"

namespace swarmcert::check {

/// |df|^2 <= dh' G dh in front of what follows the hidden layers, dx in the moving coordinates only and measured as
/// sum (dx_k / weight_k)^2.
struct LocalFunction {
  std::vector<HiddenLayer> hidden;
  Matrix gram;                   ///< G, exactly
  std::vector<int> coordinates;  ///< that move, ascending
  std::vector<double> weight;    ///< one per moving coordinate, positive

  LocalFunction() : gram(0, 0) {}
};

/// The words of a tree in preorder: "s3" halves coordinate 3 of the box at hand, its lower half first; "t5" is a leaf
/// that multipliers 5 prove.
struct TreeProof {
  std::string tree;
  std::vector<std::vector<double>> multipliers;  ///< each with one number per hidden neuron, not negative
};

struct TreeVerdict {
  bool holds = false;
  std::string reason;  ///< what fails, and where in the tree
  long leaves = 0;
};

/// Whether |f(x) - f(y)|^2 <= rho |x - y|^2 for all x, y of the box, shown by the tree. The parts cover the box: a split
/// is followed by both halves, which share the plane of the cut. The slope of f along a segment is bounded by that of
/// the parts it crosses, so each part may be proved alone.
///
/// A part. Its neurons have bounds (box_states.h). On a pair of points of the part, dz = dy for a neuron whose y stays
/// positive, dz = 0 where it stays negative, and dz (dy - dz) >= 0 otherwise. With multipliers t >= 0 of the last kind
/// and everything expressed in (dx, dz of the undecided), the claim follows from
///   S = rho I_x - F' G F - sum_i t_i (a_i e_i' + e_i a_i') >= 0,  a_i = (dy_i in these variables) - e_i.
/// S is computed in double together with a bound on the norm of what rounding changed, scaled to a unit diagonal by
/// powers of two, shifted down by that bound and by what a Cholesky factorisation in double may overlook,
/// gamma_(n+1) tr(S) (Rump 2006, BIT 46), and factorised: if that runs to its end, S is positive definite.
TreeVerdict check_tree(const LocalFunction& f, const std::vector<double>& lower,
                       const std::vector<double>& upper, double rho, const TreeProof& proof);

}  // namespace swarmcert::check
