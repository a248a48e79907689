/// @file Lower bounds for the claims about NET: which function is searched, with how many neighbours and for how long.
#pragma once

#include <Eigen/Core>
#include <atomic>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "lipschitz/base/claims.h"
#include "lipschitz/lower/slope_search.h"
#include "nn/weights/network.h"

namespace swarmcert::lipschitz {

struct LowerBoundOptions {
  std::uint64_t seed = 1;
  /// Per claim; 0: no lower bounds. Nothing: kDefaultSearchRounds, fewer for networks much larger than the paper's,
  /// for which a round takes longer. With other activations than ReLU a round is a start of steep_place().
  std::optional<int> rounds;
  double seconds = 0;  ///< per claim, as SlopeSearchOptions has it; 0: no limit
  const std::atomic<bool>* cancelled = nullptr;
  std::optional<Box> moved;             ///< where x and y lie instead of the domain's box
  std::vector<Eigen::VectorXd> starts;  ///< as SlopeSearchOptions has them
  /// As SlopeSearchOptions has them; others in the order of FoundSlope::other_networks.
  std::vector<Eigen::VectorXd> places;
  int regions = kRegionsPerRound;  ///< as SlopeSearchOptions has them
};

/// Two points that prove a lower bound for a claim.
struct FoundSlope {
  std::optional<SlopeWitness> witness;            ///< nothing where no search ran or no two points exist
  std::vector<files::FunctionId> other_networks;  ///< of witness->others, "phi:<kind>" each
  int rounds = 0;
  bool interrupted = false;  ///< stopped before all rounds were done
};

/// Whether all networks that enter `function` are ReLU networks: those that it passes through, and of a set function,
/// whose other terms are of any kind, every phi.
bool has_relu_only(const files::Network& network, const files::FunctionId& function);

/// Searches for the steepest pair of points within the claim's block and domain, as steep in the claim's norm as
/// slope() proves. Of ReLU networks by search_slope(), a set function with one to three neighbours, of every kind and
/// with the ground; of others around the steep_place(). Never among neighbours where NET is silent.
/// @param domain the boxes of a claim whose domain is "box", by part.
/// @throws std::invalid_argument as slope_function(): of functions of rotation invariants there is no such proof.
FoundSlope lower_bound(const files::Network& network, const Claim& claim, const Domain& domain,
                       const LowerBoundOptions& options);

}  // namespace swarmcert::lipschitz
