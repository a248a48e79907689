/// @file Range of NET over a box for a given number of neighbours, and its jump when a neighbour enters or leaves.
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

/// A value that the function takes, at float32 points of the box: evaluated exactly, or enclosed, and rounded inwards.
struct Attained {
  double value = 0;
  std::vector<files::FunctionId> networks;  ///< "phi:<kind>" per point, or "network"
  std::vector<std::vector<float>> points;   ///< empty: no neighbours
};

/// lower <= f <= upper in exact arithmetic, for the weights as stored, at every point of the box.
struct CertifiedRange {
  files::FunctionId function;  ///< "network" or "set:<phi kind>:<rho kind>"
  int output = 0;              ///< index of the output
  int neighbours_at_most = 0;  ///< of the kind, each anywhere in its box; 0 for a plain network
  double lower = 0, upper = 0;
  Attained least, greatest;  ///< lower <= least.value, greatest.value <= upper
  /// A neighbour that comes or goes while the others stay, anywhere in its box, as at a cut-off of the distance:
  /// |f(with it) - f(without it)| <= jump. Where NET knows one kind, with at most `neighbours_at_most` of them, each in
  /// its box; else whatever the others do, but that all are in their boxes where NET is silent before or after. 0 for
  /// a plain network.
  double jump = 0;
  double largest() const { return std::max(-lower, upper); }
};

struct RangeOptions {
  int neighbours = 1;  ///< up to this many, at least 1
  /// Boxes per search, a linear form over sums up to twice as many; 0: 16000, fewer for large networks, but at least
  /// 600.
  int nodes = 0;
  int jobs = 0;
  std::function<void(int done, int total)> progress;  ///< searches; may be empty
};

/// Boxes per search for a function of NET where nobody says: `most`, at least 600, or fewer in between for networks of
/// more than 8000 weights: a box costs about the square of their number.
int usual_nodes(const files::Network& network, const files::FunctionId& function, int most);

/// The functions whose values are enclosed: the network, or each set function of neighbours.
std::vector<files::FunctionId> value_functions(const files::Network& network);

/// Ranges of the plain network or of every set function, for 1, 2, ... neighbours of one kind; with the ground's term
/// where there is one. The clamp of NET acts first: with it the range holds for every input, where its interval lies
/// in the box. Among neighbours where NET is silent f is 0, exactly.
///
/// One neighbour: branch and bound over its box, the ground's term as an interval. More: a linear form a s + c above
/// rho on the sums s, whose neurons are bounded by such forms too (sum_support.h); f <= c + sum_j max a phi(x_j), each
/// maximum by branch and bound over one box, with parts that all forms share (part_tree.h). Several neighbours of one
/// kind, without a ground's term: also branch and bound over the box of one, for a network above rho that is convex in
/// the sum (convex_majorant.h); the smaller of both.
///
/// Of functions with other activations than ReLU: what certified_values() states, and no branch and bound.
///
/// Of networks of rotation invariants: over the boxes of invariants that hold those of the states.
/// @param domain by part, finite; of states where NET has invariants.
/// @param rho_bound a proved Lipschitz bound of rho, by its kind; for the jump |f - f'| <= L |phi(x)|.
std::vector<CertifiedRange> ranges(const files::Network& network, const Domain& domain,
                                   const std::map<std::string, double>& rho_bound,
                                   const RangeOptions& options);

/// What the network's clamp lets through of a box, per part.
Domain clamped(const files::Network& network, const Domain& domain);

/// The box that NET's clamp makes of all inputs, for every part that it clamps; empty if there is no clamp, or a part
/// without one (the ground).
Domain clamp_domain(const files::Network& network);

}  // namespace swarmcert::lipschitz
