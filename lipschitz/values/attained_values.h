/// @file Values that networks of any activations take on a box, enclosed in exact arithmetic.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "lipschitz/base/box.h"
#include "lipschitz/values/range.h"
#include "nn/weights/network.h"

namespace swarmcert::lipschitz {

/// The least and the greatest value of one output that a search found.
struct AttainedEnds {
  Attained least, greatest;
};

/// Searches the box in double and encloses the values of the two best points (check::network_intervals()): `value` of
/// the greatest is not above the function there, that of the least not below. One per output; empty points where the
/// box holds no float32.
/// @param function "network" or "set:<phi kind>:<rho kind>", with 1 to `neighbours` of the kind and the ground's input.
/// @param domain by part, finite, as it leaves the clamp; of states, before it, where the network has invariants.
std::vector<AttainedEnds> attained_ends(const files::Network& network, const Domain& domain,
                                        const files::FunctionId& function, int neighbours,
                                        std::uint64_t seed = 1);

}  // namespace swarmcert::lipschitz
