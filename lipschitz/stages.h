/// @file What the functions of NET are to a bound: chains of exact matrices with ReLU between them.
#pragma once

#include <string>
#include <vector>

#include "lipschitz/checker/dyadic.h"
#include "lipschitz/checker/tree_proof.h"
#include "nn/files/network.h"

namespace swarmcert::check {

/// M_1 .. M_K of `function` ("network", "phi:<kind>", "rho:<kind>", "set:<phi kind>:<rho kind>"), exactly, as they act
/// on the input coordinates of `block`, each in units of its `scale` (empty: 1). In a set function the last layer of
/// phi and the first of rho, which no ReLU separates, are one stage: their product.
/// @throws std::out_of_range or std::invalid_argument if NET has no such function or block, or `scale` has not one
///   number per input.
std::vector<Matrix> stages(const files::Network& network, const std::string& function,
                           const std::string& block = "all", const std::vector<double>& scale = {});

/// "network" or "phi:<kind>" in front of |.|^2, or of the form Q, exactly, as a proof on a box sees it.
/// @param q [outputs x outputs]; no rows: the identity.
/// @throws as stages(), and std::invalid_argument if the network has no hidden layer or Q another size.
LocalFunction local_function(const files::Network& network, const std::string& part, const std::string& block,
                             const std::vector<double>& scale, const Matrix& q);

}  // namespace swarmcert::check
