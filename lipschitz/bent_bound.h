/// @file LipSDP-Neuron bounds of chains whose activations have slopes in [1 - c, c], as SiLU and GELU have.
#pragma once

#include "lipschitz/sdp_bound.h"

namespace swarmcert::lipschitz {

/// sdp_bound() of such a chain, whose optimum is at most the product of the norms and of the c.
///
/// Long chains go to minimise_chain(). Short ones are solved in the variables u = z - (1 - c) y, where y enters a
/// neuron and z leaves it: the constraint of a neuron is u ((2 c - 1) y - u) >= 0, of rank two in a single u, which is
/// the form of RankTwoInequality, for which minimise() is made. The matrix over (x, u) is dense, because y depends on
/// all layers before.
/// @param chain at least one g positive.
SdpBound bent_bound(const check::BentChain& chain, const SdpOptions& options = {});

}  // namespace swarmcert::lipschitz
