/// @file Several networks as one: a deep set that is their mean.
#pragma once

#include <vector>

#include "nn/training/layout.h"

namespace swarmcert::learning {

/// The layout of the mean of `members` networks of layout `one`: hidden layers and the width between phi and rho are
/// `members` times as wide; inputs and outputs are the same. @throws std::invalid_argument if members < 1.
training::Layout layout_of_mean(const training::Layout& one, int members);

/// theta of layout_of_mean() whose function is f = (f_1 + ... + f_K) / K, f_k that of members[k] [one.size()]:
///   phi stacks the phi_k, rho has the layers of the rho_k as blocks of a diagonal, and its last layer adds up.
/// As it stands the first layer of phi would have a norm of up to sqrt(K) of theirs, and the last one of rho as much
/// less. ReLU networks are homogeneous: the first takes 1/sqrt(K), the last sqrt(K), and every layer's norm is at most
/// the largest of the members' norms of that layer, whose gamma is kept. Its joint Lipschitz constants are at most the
/// mean of theirs. Both in exact arithmetic: weights are rounded to float32, exactly for K = 4^n.
/// @throws std::invalid_argument without members, or if one is not of this layout.
training::Vector mean_network(const training::Layout& one, const std::vector<training::Vector>& members);

}  // namespace swarmcert::learning
