/// @file Ranges, jumps and float32 errors for a certificate: bounds layer by layer that the checker can verify.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "lipschitz/base/box.h"
#include "lipschitz/checker/statement.h"
#include "nn/weights/network.h"

namespace swarmcert::lipschitz {

/// Bounds on the output of a layer or on a sum of terms over a box, rounded outwards.
struct VectorBounds {
  std::vector<double> lower, upper;
  /// Errors of the float32 evaluation, entry by entry, by check::Summation; empty: not bounded.
  std::array<std::vector<double>, 2> error;
};

/// Bounds in a certificate on the values of one function over a box (checker/statement.h). Computed by intervals, layer
/// by layer, and for activations other than ReLU also by linear forms (checker/centred_form.h). They are wider than the
/// branch-and-bound results of range.h and float32_error.h, but easy to verify. Of an error there are two bounds: one
/// for sums in any order, and one for the order of nn/dense_layer.h.
struct CertifiedValues {
  files::FunctionId function;  ///< "network" or "set:<phi kind>:<rho kind>"
  int neighbours = 0;          ///< largest number of neighbours of the kind; 0 for a plain network
  bool in_clamp = false;       ///< the box is the range of the input clamp
  std::map<files::FunctionId, std::vector<double>>
      input_error;  ///< by network; empty: no statement about float32
  std::map<files::FunctionId, std::vector<VectorBounds>> layers;  ///< for each network, before its ReLU
  std::optional<VectorBounds> sum;  ///< the input of rho; nothing for a plain network
  /// Bounds of f: those of the last layer; widened to contain 0 if NET is silent for some composition of at most
  /// `neighbours` neighbours, and exactly 0 if it is silent for all of them.
  std::vector<double> lower, upper;
  std::optional<double> jump;  ///< change when a neighbour enters or leaves, Euclidean norm
  std::array<std::optional<double>, 2> float32_error;  ///< Euclidean norm, by check::Summation
};

struct ValueOptions {
  int neighbours = 1;     ///< numbers of neighbours are 1, 2, ... up to this
  bool in_clamp = false;  ///< `domain` is clamp_domain() of the network
  /// Computes errors of the float32 evaluation. Requires that all weights are stored in float32 and all activations are
  /// ReLU.
  bool float32 = false;
  double input_step = 0;  ///< inputs are multiples of this, rounded to nearest; 0: only rounded to float32
  /// For the float32 errors: proved spectral norms of the layers and, where the certificate contains one that holds for
  /// all inputs, the Lipschitz bound of a network.
  std::map<files::FunctionId, std::vector<double>> norms = {};
  std::map<files::FunctionId, double> slopes = {};
};

/// Returns the value bounds of the plain network, or of every set function of a kind of neighbours. Omits bounds that
/// do not fit into a double, and float32 errors if float32 might overflow.
/// @param domain by part, finite, for every input.
/// @param rho_bound proved Lipschitz bounds of rho by kind, which the certificate contains.
/// @param only the only function to be bounded; nothing: all functions.
std::vector<CertifiedValues> certified_values(const files::Network& network, const Domain& domain,
                                              const std::map<std::string, double>& rho_bound,
                                              const ValueOptions& options,
                                              const std::optional<files::FunctionId>& only = std::nullopt);

}  // namespace swarmcert::lipschitz
