/// @file Bound on the distance between the float32 evaluation that flies and the exact function.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "lipschitz/base/box.h"
#include "lipschitz/base/stop.h"
#include "lipschitz/checker/bounds.h"
#include "nn/weights/network.h"

namespace swarmcert::lipschitz {

/// |f32(q(x)) - f(x)|_2 over the box, f32 being nn/mlp.h and nn/deep_set.h in float, f the exact function of the
/// weights as stored, q the conversion of the inputs to what the evaluation gets.
struct Float32Error {
  files::FunctionId function;  ///< "network" or "set:<phi kind>:<rho kind>"
  int neighbours_at_most = 0;  ///< of the kind; 0 for a plain network
  UpperBound evaluation{0};    ///< |f32(x) - f(x)| for float32 inputs x
  UpperBound inputs{
      0};  ///< |f(q(x)) - f(x)|: rounding to float32, and half a step where inputs are quantised
  UpperBound total{0};
};

struct Float32Options {
  int neighbours = 1;     ///< up to this many
  double input_step = 0;  ///< inputs are multiples of this, rounded to nearest; 0: only rounded to float32
  int nodes = 0;          ///< parts of the box per function; 0: 8000, fewer for large networks, at least 600
  int jobs = 0;
  /// Ends the semidefinite programs of the tails, for bounds layer by layer in their place, and the search of parts.
  Stop stop;
};

/// How far an input's conversion may move it, per coordinate: rounding to float32, and half a step.
std::vector<double> input_errors(const Box& box, double step);

/// Bounds that hold in exact arithmetic for the order of summation of nn/mlp.h and nn/deep_set.h, with or without fused
/// multiply-adds; those of the certificate hold for any order.
///
/// A computed layer differs from the exact layer at the same computed inputs by at most delta_k, entry by entry
/// (layer_rounding()). Replacing the computed layers by exact ones from the last to the first changes the output by at
/// most
///   sum_k min(L_k |delta_k|_2, |S_k delta_k|_2),
/// where L_k is a proved Lipschitz bound of what follows layer k (LipSDP of the tail, which holds at every point, hence
/// for any other neighbours), and S_k bounds its derivative over the part of the box (sensitivities()). Values of
/// layers come from bounds over parts of the box (reach.h, affine_forms.h), plus what was computed wrong before. Sums
/// over n neighbours add gamma_{n-1} sum_j |phi_j| in front of rho, gamma_n with the ground's term: what is added to
/// zero is exact.
///
/// @param domain by part, finite.
/// @param lipschitz proved bounds by function: of "network" or the set functions, the ground's among them.
/// @throws std::invalid_argument if a network is not stored in float32: its evaluation rounds the weights first.
std::vector<Float32Error> float32_errors(const files::Network& network, const Domain& domain,
                                         const std::map<files::FunctionId, double>& lipschitz,
                                         const Float32Options& options);

}  // namespace swarmcert::lipschitz
