/// @file A path-following method for LipSDP-Neuron of large chains, whose memory is one matrix over the neurons. Not
/// for users.
#pragma once

#include <optional>

#include "lipschitz/solver/chain_slack.h"
#include "lipschitz/solver/interior_point.h"

namespace swarmcert::lipschitz {

/// Minimises rho over (rho, t) subject to S(rho, t) >= 0, the program of solve_lipsdp(), by following the path of the
/// minimisers of rho / mu - log det S as mu goes to zero.
///
/// S is block tridiagonal with one block per layer, so that its factor and the blocks of its inverse that the gradient
/// needs cost time and memory that grow linearly with depth. Newton's matrix H is dense over the n neurons. It is
/// built block column by block column from those of S^-1, for at most 4 n^2 times the width, and factorised in place.
/// One H per step serves the correction towards the path, the extrapolation along the path, and the test how far that
/// may go. It starts from multipliers that are equal within each layer, with steps that H limits while the path is
/// far.
///
/// Compared with minimise(): a fifth of the memory, a quarter to a twentieth of the time per step, at the price of less
/// accuracy near the optimum: meant for a relative gap of 1e-6.
/// @returns floating point estimates without a guarantee: verify them.
InteriorPointResult minimise_chain(const ChainSlack& chain, const InteriorPointOptions& options);

/// minimise_chain() where it is the better choice: for more than 300 neurons, where its steps cost so much less than
/// those of minimise() that they may gain less.
/// @param options of minimise(); the gap is at least 5e-7 here.
/// @returns nothing for shorter chains, and where it stopped short of the optimum of a chain that minimise() can solve.
std::optional<InteriorPointResult> minimise_long_chain(const ChainSlack& chain, InteriorPointOptions options);

}  // namespace swarmcert::lipschitz
