/// @file Boxes of rotation invariants that enclose the invariants of a box of states.
#pragma once

#include <map>
#include <string>

#include "lipschitz/base/box.h"

namespace swarmcert::lipschitz {

/// Returns the range of each invariant (nn/invariants.h) over a box of states: exact bounds, rounded outwards.
/// @param part  "phi:<kind>"; for "phi:ground", states are those of the vehicle, otherwise those of a neighbour.
Box invariant_box(const files::FunctionId& part, const Box& states);

/// Returns the invariant boxes of all parts.
Domain invariant_boxes(const Domain& states);

}  // namespace swarmcert::lipschitz
