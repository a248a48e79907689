/// @file Boxes of rotation invariants that hold those of a box of states.
#pragma once

#include <map>
#include <string>

#include "lipschitz/base/box.h"

namespace swarmcert::lipschitz {

/// Where the invariants lie that phi sees of states in a box (nn/invariants.h), each by itself: exact bounds, rounded
/// outwards.
/// @param part  "phi:<kind>"; states of "phi:ground" are the vehicle's own, of others those of a neighbour.
Box invariant_box(const files::FunctionId& part, const Box& states);

/// Of every part.
Domain invariant_boxes(const Domain& states);

}  // namespace swarmcert::lipschitz
