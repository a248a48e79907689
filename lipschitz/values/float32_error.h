/// @file Bound on the difference between the float32 evaluation used in flight and the exact function.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "lipschitz/base/box.h"
#include "lipschitz/base/stop.h"
#include "lipschitz/checker/bounds.h"
#include "nn/weights/network.h"

namespace swarmcert::lipschitz {

/// Bound on |f32(q(x)) - f(x)|_2 over the box: f32 is nn/mlp.h or nn/deep_set.h in float, f the exact function of the
/// weights as stored, and q the conversion of the inputs before the evaluation.
struct Float32Error {
  files::FunctionId function;  ///< "network" or "set:<phi kind>:<rho kind>"
  int neighbours_at_most = 0;  ///< largest number of neighbours of the kind; 0 for a plain network
  UpperBound evaluation{0};    ///< |f32(x) - f(x)| for float32 inputs x
  UpperBound inputs{0};  ///< |f(q(x)) - f(x)|: rounding to float32, and half a step if inputs are quantised
  UpperBound total{0};
};

struct Float32Options {
  int neighbours = 1;     ///< largest number of neighbours
  double input_step = 0;  ///< inputs are multiples of this, rounded to nearest; 0: only rounded to float32
  int nodes = 0;          ///< parts of the box per function; 0: 16000, fewer for large networks, at least 600
  int jobs = 0;
  /// Ends the search over parts and the semidefinite programs of the tails; tails then get layer-by-layer bounds.
  Stop stop;
};

/// Returns per coordinate a bound on the error of converting an input: rounding to float32, and half a step.
std::vector<double> input_errors(const Box& box, double step);

/// Returns error bounds that hold in exact arithmetic for the order of summation of nn/mlp.h and nn/deep_set.h, with or
/// without fused multiply-adds. (The certificate states wider ones for this order, and others for any.)
///
/// A computed layer differs from the exact layer at the same computed inputs by at most delta_k, entry by entry
/// (layer_rounding()). Replacing the computed layers by exact ones from the last to the first changes the output by at
/// most
///   sum_k min(L_k |delta_k|_2, |S_k delta_k|_2),
/// where L_k is a proved Lipschitz bound of the layers behind layer k (LipSDP of the tail, which holds at every point
/// and hence for any other neighbours), and S_k bounds the derivative of these layers over the part of the box
/// (sensitivities()). Layer values are bounded over parts of the box (reach.h, affine_forms.h), plus the errors of
/// previous layers. Sums over n neighbours add gamma_{n-1} sum_j |phi_j| in front of rho, or gamma_n with the ground's
/// term, because the addition to zero is exact.
///
/// @param domain by part, finite.
/// @param lipschitz proved bounds by function: for "network", or for the set functions including the ground's.
/// @throws std::invalid_argument if a network is not stored in float32, because its evaluation rounds the weights
///   first.
std::vector<Float32Error> float32_errors(const files::Network& network, const Domain& domain,
                                         const std::map<files::FunctionId, double>& lipschitz,
                                         const Float32Options& options);

}  // namespace swarmcert::lipschitz
