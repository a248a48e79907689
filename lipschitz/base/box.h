/// @file Axis-parallel boxes: the domains of local bounds.
#pragma once

#include <map>
#include <vector>

#include "nn/weights/function_id.h"

namespace swarmcert::lipschitz {

/// {x : lower[k] <= x[k] <= upper[k]}, in the units of the network's inputs. Infinite bounds leave a side
/// open.
struct Box {
  std::vector<double> lower, upper;
};

/// By part of NET, a plain network or a phi: where its inputs lie.
using Domain = std::map<files::FunctionId, Box>;

}  // namespace swarmcert::lipschitz
