/// @file LipSDP-Neuron bounds of chains whose neurons have slopes in any [a, b]: of SiLU and GELU, and on boxes.
#pragma once

#include "lipschitz/upper/sdp_bound.h"

namespace swarmcert::lipschitz {

/// Where the neurons of a layer have different slopes, the program is dense: then chains with more variables (inputs,
/// after those of a wide first stage are reduced to its rows, and neurons) are left to the product of norms.
inline constexpr int kMostBentVariables = 1400;

/// sdp_bound() of such a chain, whose optimum is at most the product of the norms and of each layer's steepest slope.
///
/// Long chains whose layers each have slopes in one [1 - c, c] go to minimise_chain(). Others are solved in the
/// variables w = (z - a y) / sqrt(b - a), where y enters a neuron and z leaves it: the constraint of a neuron is
/// w (sqrt(b - a) y - w) >= 0, of rank two in a single w, which is the form of RankTwoInequality, for which minimise()
/// is made. The matrix over (x, w) is dense, because y depends on all layers before. The root keeps multipliers of one
/// size, however narrow a range is.
/// @param chain a < b in each range.
/// @returns no proof where the slopes are others and the chain has more than kMostBentVariables.
SdpBound bent_bound(const check::BentChain& chain, const SdpOptions& options = {});

}  // namespace swarmcert::lipschitz
