/// @file Range of NET over a box for a given number of neighbours, and the jump when a neighbour enters or leaves.
#pragma once

#include <algorithm>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "lipschitz/base/box.h"
#include "lipschitz/base/claims.h"
#include "lipschitz/checker/witness.h"
#include "lipschitz/values/reach.h"
#include "nn/weights/network.h"

namespace swarmcert::lipschitz {

/// A value of the function at float32 points of the box: evaluated exactly or enclosed, and rounded inwards.
struct Attained {
  double value = 0;
  std::vector<files::FunctionId> networks;  ///< "phi:<kind>" per point, or "network"
  std::vector<std::vector<float>> points;   ///< empty: no neighbours
};

/// lower <= f <= upper in exact arithmetic, for the weights as stored, at every point of the box.
struct CertifiedRange {
  files::FunctionId function;  ///< "network" or "set:<phi kind>:<rho kind>"
  int output = 0;              ///< index of the output
  /// Largest number of neighbours of the kind, each anywhere in its box; 0 for a plain network.
  int neighbours_at_most = 0;
  double lower = 0, upper = 0;
  Attained least, greatest;  ///< lower <= least.value, greatest.value <= upper
  /// Bound on the change when a neighbour anywhere in its box enters or leaves while the others stay, as at a distance
  /// cut-off: |f(with it) - f(without it)| <= jump. If NET has one kind, it holds for at most `neighbours_at_most`
  /// neighbours, each in its box; otherwise for any other neighbours, except that all must be in their boxes if NET is
  /// silent before or after. 0 for a plain network.
  double jump = 0;
  double largest() const { return std::max(-lower, upper); }
};

struct RangeOptions {
  int neighbours = 1;  ///< largest number of neighbours, at least 1
  /// Boxes per search; up to twice as many for a linear form over sums. 0: 16000, fewer for large networks, but at
  /// least 600.
  int nodes = 0;
  int jobs = 0;
  std::function<void(int done, int total)> progress;  ///< counts searches; may be empty
};

/// Returns the default number of boxes per search for a function of NET: `most`, or fewer, but at least 600, for
/// networks of more than 8000 weights, because the cost of a box grows with about the square of this number.
int usual_nodes(const files::Network& network, const files::FunctionId& function, int most);

/// Returns the functions whose values are enclosed: the network, or each set function of neighbours.
std::vector<files::FunctionId> value_functions(const files::Network& network);

/// Returns the ranges of the plain network, or of every set function for 1, 2, ... neighbours of one kind and the
/// ground's term if there is one. The clamp of NET is applied first, so the range holds for every input if the clamp's
/// interval lies in the box. For compositions in which NET is silent, f is exactly 0.
///
/// One neighbour: branch and bound over its box, with the ground's term as an interval. More neighbours: rho is bounded
/// on the sums s by a linear form a s + c, and its neurons by such forms too (sum_support.h). Then
/// f <= c + sum_j max a phi(x_j), with each maximum computed by branch and bound over one box, in parts shared by all
/// forms (part_tree.h). Several neighbours of one kind without a ground's term: in addition, branch and bound over the
/// box of one neighbour for a network that bounds rho from above and is convex in the sum (convex_majorant.h); the
/// smaller bound is returned.
///
/// Functions with activations other than ReLU get the bounds of certified_values(), without branch and bound.
///
/// @param domain by part, finite.
/// @param rho_bound proved Lipschitz bounds of rho by kind, for the jump |f - f'| <= L |phi(x)|.
std::vector<CertifiedRange> ranges(const files::Network& network, const Domain& domain,
                                   const std::map<std::string, double>& rho_bound,
                                   const RangeOptions& options);

/// Returns the image of the boxes under the network's clamp, by part.
Domain clamped(const files::Network& network, const Domain& domain);

/// Returns the box to which NET's clamp maps all inputs, by part; empty if there is no clamp or a part without clamp
/// (the ground).
Domain clamp_domain(const files::Network& network);

}  // namespace swarmcert::lipschitz
