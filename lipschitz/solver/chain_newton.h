/// @file A path-following method for LipSDP-Neuron of large chains that stores a single matrix over all neurons. Not
/// for users.
#pragma once

#include <optional>

#include "lipschitz/solver/chain_slack.h"
#include "lipschitz/solver/interior_point.h"

namespace swarmcert::lipschitz {

/// Minimises rho over (rho, t) subject to S(rho, t) >= 0, the program of solve_lipsdp(), by following the central path:
/// the minimisers of rho / mu - log det S as mu goes to zero.
///
/// S is block tridiagonal with one block per layer, so the time and memory for its factor and for the blocks of its
/// inverse that the gradient needs grow linearly with depth. The Newton matrix H is dense over the n neurons. It is
/// built one block column at a time from the block columns of S^-1, in at most 4 n^2 times the width operations, and
/// factorised in place. One H per step is used for the correction towards the path, for the extrapolation along the
/// path, and to limit the length of the extrapolation. The method starts from multipliers that are equal within each
/// layer; while the path is far, H limits the steps.
///
/// Compared with minimise(), it needs a fifth of the memory and a quarter to a twentieth of the time per step, but is
/// less accurate near the optimum. It is meant for a relative gap of 1e-6.
/// @returns floating-point estimates without a guarantee: verify them.
InteriorPointResult minimise_chain(const ChainSlack& chain, const InteriorPointOptions& options);

/// Calls minimise_chain() if it is the better choice: for more than 300 neurons, where its steps are so much cheaper
/// than those of minimise() that it may take more of them.
/// @param options options for minimise(); the gap is increased to at least 5e-7.
/// @returns nothing for shorter chains, and if it stopped short of the optimum of a chain that minimise() can solve.
std::optional<InteriorPointResult> minimise_long_chain(const ChainSlack& chain, InteriorPointOptions options);

}  // namespace swarmcert::lipschitz
