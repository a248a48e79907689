/// @file Ranges, jumps and float32 errors as a certificate carries them: layer by layer, for the checker to verify.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "lipschitz/base/box.h"
#include "nn/weights/network.h"

namespace swarmcert::lipschitz {

/// Bounds on what a layer, or a sum of terms, gives over a box; rounded outwards.
struct VectorBounds {
  std::vector<double> lower, upper;
  std::vector<double> error;  ///< of the float32 evaluation, entry by entry; empty: not bounded
};

/// What a certificate states of one function's values over a box (checker/statement.h). By intervals, layer by layer,
/// of other activations than ReLU also by linear forms (checker/centred_form.h): wider than range.h and float32_error.h
/// find by branch and bound, and as easy to verify.
struct CertifiedValues {
  files::FunctionId function;  ///< "network" or "set:<phi kind>:<rho kind>"
  int neighbours = 0;          ///< at most, of the kind; 0 for a plain network
  bool in_clamp = false;       ///< the box is what the input clamp lets through
  std::map<files::FunctionId, std::vector<double>>
      input_error;  ///< by network; empty: nothing is said of float32
  std::map<files::FunctionId, std::vector<VectorBounds>> layers;  ///< of each network, before its ReLU
  std::optional<VectorBounds> sum;  ///< what rho takes in; nothing for a plain network
  /// Bounds of f: those of the last layer; widened to contain 0 if NET is silent for some composition of at most
  /// `neighbours` neighbours, and exactly 0 if it is silent for all of them.
  std::vector<double> lower, upper;
  std::optional<double> jump;           ///< where a neighbour comes or goes, Euclidean
  std::optional<double> float32_error;  ///< Euclidean
};

struct ValueOptions {
  int neighbours = 1;     ///< 1, 2, ... up to this many
  bool in_clamp = false;  ///< `domain` is clamp_domain() of the network
  /// With errors of the float32 evaluation: all weights are stored in float32, all activations are ReLU.
  bool float32 = false;
  double input_step = 0;  ///< inputs are multiples of this, rounded to nearest; 0: only rounded to float32
};

/// Of the plain network, or of every set function of a kind of neighbours. Left out is what does not fit into a double;
/// float32 errors where float32 might overflow.
/// @param domain by part, finite, of every input.
/// @param rho_bound a proved Lipschitz bound of rho, by its kind, which the certificate contains.
/// @param only of this function; nothing: of all.
std::vector<CertifiedValues> certified_values(const files::Network& network, const Domain& domain,
                                              const std::map<std::string, double>& rho_bound,
                                              const ValueOptions& options,
                                              const std::optional<files::FunctionId>& only = std::nullopt);

}  // namespace swarmcert::lipschitz
