/// @file Attained values of networks with any activations on a box, enclosed in exact arithmetic.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "lipschitz/base/box.h"
#include "lipschitz/values/range.h"
#include "nn/weights/network.h"

namespace swarmcert::lipschitz {

/// The least and the greatest value of one output found by a search.
struct AttainedEnds {
  Attained least, greatest;
};

/// Searches the box in double and encloses the values at the two best points (check::network_intervals()). `value` of
/// the greatest is not above the function there, `value` of the least is not below it. Returns one entry per output;
/// the points are empty if the box contains no float32.
/// @param function "network" or "set:<phi kind>:<rho kind>", with 1 to `neighbours` of the kind and the ground's input.
/// @param domain by part, finite, after the clamp.
std::vector<AttainedEnds> attained_ends(const files::Network& network, const Domain& domain,
                                        const files::FunctionId& function, int neighbours,
                                        std::uint64_t seed = 1);

}  // namespace swarmcert::lipschitz
