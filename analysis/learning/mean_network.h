/// @file Combines several networks into one deep set that is their mean.
#pragma once

#include <vector>

#include "nn/training/layout.h"

namespace swarmcert::learning {

/// Returns the layout of the mean of `members` networks of layout `one`: hidden layers and the width between phi and
/// rho are `members` times as wide; inputs and outputs are unchanged.
/// @throws std::invalid_argument if members < 1.
training::Layout layout_of_mean(const training::Layout& one, int members);

/// Returns theta of layout_of_mean() for the function f = (f_1 + ... + f_K) / K, where f_k is that of members[k]
/// [one.size()]: phi stacks the phi_k; rho has the layers of the rho_k as blocks on the diagonal, and its last layer
/// sums. Without rescaling, the first layer of phi would have a norm of up to sqrt(K) times that of the members, and
/// the last layer of rho a norm smaller by the same factor. ReLU networks are homogeneous, so the first layer is
/// multiplied by 1/sqrt(K) and the last by sqrt(K). The norm of every layer is then at most the largest of the members'
/// norms of that layer, so that gamma holds, and the joint Lipschitz constants are at most the mean of the members'
/// constants. Both hold in exact arithmetic; rounding the weights to float32 is exact for K = 4^n.
/// @throws std::invalid_argument if there are no members, or if one has another layout.
training::Vector mean_network(const training::Layout& one, const std::vector<training::Vector>& members);

}  // namespace swarmcert::learning
