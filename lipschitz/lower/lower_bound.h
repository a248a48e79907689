/// @file Lower bounds for the claims about NET.
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
  /// Search rounds per claim; 0: no lower bounds. Nothing: kDefaultSearchRounds, or fewer for networks much larger than
  /// those of the paper, for which a round takes longer. With activations other than ReLU, a round is one start of
  /// steep_place().
  std::optional<int> rounds;
  double seconds = 0;  ///< limit per claim, see SlopeSearchOptions; 0: no limit
  const std::atomic<bool>* cancelled = nullptr;
  std::vector<Eigen::VectorXd> starts;  ///< see SlopeSearchOptions
};

/// Two points that prove a lower bound for a claim.
struct FoundSlope {
  std::optional<SlopeWitness> witness;            ///< nothing if no search ran or there are no two points
  std::vector<files::FunctionId> other_networks;  ///< networks of witness->others, "phi:<kind>" each
  int rounds = 0;
  bool interrupted = false;  ///< stopped before all rounds were done
};

/// Returns whether all networks that enter `function` are ReLU networks. For a set function, whose other terms may be
/// of any kind, these include every phi.
bool has_relu_only(const files::Network& network, const files::FunctionId& function);

/// Searches for the steepest pair of points within the claim's block and domain. The bound is the slope in the claim's
/// norm, proved by slope().
///
/// ReLU networks are searched by search_slope(); a set function with one to three neighbours, of every kind, and with
/// the ground. Other networks are searched around the result of steep_place(). Compositions in which NET is silent are
/// not used.
/// @param domain the boxes of a claim whose domain is "box", by part.
/// @throws std::invalid_argument as slope_function().
FoundSlope lower_bound(const files::Network& network, const Claim& claim, const Domain& domain,
                       const LowerBoundOptions& options);

}  // namespace swarmcert::lipschitz
