/// @file From proposed multipliers to a proof that the checker accepts.
#pragma once

#include <optional>
#include <vector>

#include "lipschitz/checker/bounds.h"
#include "lipschitz/checker/lipschitz_lmi.h"
#include "lipschitz/checker/proposed_factor.h"

namespace swarmcert::lipschitz {

/// An upper bound on a chain's Lipschitz constant with its proof: sqrt(rho) <= upper, and a factor proves that
/// check::lipschitz_lmi(stages, rho, t) is positive semidefinite. The factor is `factor` or, if that is empty, the
/// result of check::proposed_factor().
struct UpperProof {
  UpperBound upper{0};
  double rho = 0;
  std::vector<double> t;
  std::optional<check::Factor> factor;
};

/// Proofs contain factors of at most this many rows. A larger factor would be several times as long as the weights, and
/// the checker can recompute it as fast as read it.
inline constexpr std::size_t kMostFactorRows = 64;

/// Returns a verified proof that sqrt(rho) bounds the chain, or nothing if (rho, t) does not satisfy the inequality
/// with a margin for round-off. `upper` is the smallest double whose square is at least rho.
std::optional<UpperProof> prove(const std::vector<check::Matrix>& stages, double rho,
                                const std::vector<double>& t);
/// The same for a chain whose neurons have other slope ranges, by its lipschitz_lmi().
std::optional<UpperProof> prove(const check::BentChain& chain, double rho, const std::vector<double>& t);

using check::to_double;

}  // namespace swarmcert::lipschitz
