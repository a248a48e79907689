/// @file Other upper bounds of a chain, a lower limit for all of them, and which layers make the bound loose.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "lipschitz/base/stop.h"
#include "lipschitz/checker/bounds.h"
#include "lipschitz/checker/dyadic.h"
#include "lipschitz/upper/eclipse_fast.h"
#include "lipschitz/upper/lmi_proof.h"
#include "nn/weights/network.h"

namespace swarmcert::lipschitz {

/// Combettes and Pesquet 2020: ReLU is the mean of the identity and a reflection, so with M_ij = M_j ... M_{i+1}
///   L <= 2^{1-K} c_K,  c_0 = 1,  c_j = sum_{i<j} c_i |M_ij|_2.
/// Every norm is proved in exact arithmetic and the sum is rounded up. Returns nothing if a norm could not be proved or
/// after a stop.
std::optional<UpperBound> combettes_pesquet(const std::vector<check::Matrix>& stages, const Stop& stop = {});

/// The steepest activation pattern found, whether or not an input reaches it: |M_K D_{K-1} ... D_1 M_1|_2 with diagonal
/// matrices D_k of zeros and ones. No upper bound that ignores which patterns are reachable can lie below the largest
/// such norm. The value found is therefore a floor for these bounds, up to round-off; it is not itself a bound.
struct PatternFloor {
  Estimate slope{0};
  /// |M_k z| / |z| and |D_k y| / |y| along the top singular direction of that product. Their product is `slope`.
  std::vector<double> gains;       ///< [K]
  std::vector<double> relu_gains;  ///< [K - 1]
};

/// Searches by alternating maximisation over layers from `starts` random patterns, then by flipping single neurons;
/// deterministic.
/// @param stop ends the search; the best pattern so far is returned.
PatternFloor pattern_floor(const std::vector<check::Matrix>& stages, int starts = 24, std::uint64_t seed = 1,
                           const Stop& stop = {});

/// How much one stage of a function loosens the product bound: its norm over its gain along the steepest pattern, at
/// least 1.
struct StageLoss {
  std::string name;  ///< "fc2", "fc4 of phi with fc1 of rho"
  double norm = 0;   ///< spectral norm, rounded
  double gain = 0;
  double loss() const { return gain > 0 ? norm / gain : 0; }
};

struct Comparison {
  std::optional<UpperBound> combettes_pesquet;
  std::optional<UpperProof> eclipse_fast;
  PatternFloor floor;
  std::vector<StageLoss> stages;
};

/// Computes all of the above for one function and block of NET. Entries that a stop leaves no time for are missing.
Comparison compare(const files::Network& network, const files::FunctionId& function, const std::string& block,
                   const std::vector<double>& scale, const Stop& stop = {});

}  // namespace swarmcert::lipschitz
