/// @file Axis-parallel boxes: the domains of local bounds.
#pragma once

#include <vector>

namespace swarmcert::lipschitz {

/// {x : lower[k] <= x[k] <= upper[k]}, in the units of the network's inputs. Infinite bounds leave a side
/// open.
struct Box {
  std::vector<double> lower, upper;
};

}  // namespace swarmcert::lipschitz
