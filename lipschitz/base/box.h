/// @file Axis-parallel boxes: the domains of local bounds.
#pragma once

#include <map>
#include <vector>

#include "nn/weights/function_id.h"

namespace swarmcert::lipschitz {

/// {x : lower[k] <= x[k] <= upper[k]}, in the units of the network's inputs. Bounds may be infinite.
struct Box {
  std::vector<double> lower, upper;
};

/// The input box of each part of NET: the plain network or each phi.
using Domain = std::map<files::FunctionId, Box>;

}  // namespace swarmcert::lipschitz
