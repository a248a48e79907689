/// @file The functions of NET as chains of exact matrices with activations of slopes between 0 and 1 in between. Not
/// for users.
#pragma once

#include <string>
#include <vector>

#include "lipschitz/checker/dyadic.h"
#include "lipschitz/checker/lipschitz_lmi.h"
#include "lipschitz/checker/tree_proof.h"
#include "lipschitz/checker/values.h"
#include "nn/weights/function_id.h"
#include "nn/weights/network.h"

namespace swarmcert::check {

/// M_1 .. M_K of `function` ("network", "phi:<kind>", "rho:<kind>", "set:<phi kind>:<rho kind>"), exactly, as they act
/// on the input coordinates of `block`, each in units of its `scale` (empty: 1). In a set function the last layer of
/// phi and the first of rho, which no activation separates, are one stage: their product.
/// An activation s of slopes in [0, b] is b times one of slopes in [0, 1]: the stage behind it is multiplied by b. ReLU
/// has b = 1. Where `function` maps its inputs to invariants, the first stage acts on those, and is multiplied by the
/// map's Lipschitz constant: every bound of the chain is one of the function.
/// @throws std::domain_error if an activation of `function` sorts, or is not monotone: see bent_chain();
///   std::out_of_range or std::invalid_argument if NET has no such function or block, or `scale` has
///   not one number per input.
std::vector<Matrix> stages(const files::Network& network, const files::FunctionId& function,
                           const std::string& block = "all", const std::vector<double>& scale = {});

/// The same for any activations, with the slopes of each hidden neuron: [0, 1], and [1 - c, c] where they are such,
/// 1 < c; those are not divided by their largest slope.
/// @throws as stages(), but for monotony.
BentChain bent_chain(const files::Network& network, const files::FunctionId& function,
                     const std::string& block = "all", const std::vector<double>& scale = {});

/// The same for inputs in `box`, no activation divided by its largest slope: the neurons of the part that takes them
/// have the slopes of slopes_on_box(), those of rho behind it all that their activation has, because other terms of the
/// sum may be anything.
/// @param box of the inputs of "network" or "phi:<kind>", as they leave the clamp.
/// @throws as bent_chain(); std::domain_error for "rho:<kind>", which has no box.
BentChain chain_on_box(const files::Network& network, const files::FunctionId& function,
                       const std::string& block, const std::vector<double>& scale, const Intervals& box);

/// At least the product of the steepest slopes between all layers of `weights`, layer by layer, for inputs in `box`.
Dyadic steepest_on_box(const files::Weights& weights, const Intervals& box);

/// "network" or "phi:<kind>" in front of |.|^2, or of the form Q, exactly, as a proof on a box sees it.
/// @param q [outputs x outputs]; no rows: the identity.
/// @throws as stages(), and std::invalid_argument if the network has no hidden layer or Q another size.
LocalFunction local_function(const files::Network& network, const files::FunctionId& part,
                             const std::string& block, const std::vector<double>& scale, const Matrix& q);

/// What `phi` adds to the values before the first ReLU of `rho`: V phi(x), with V the first layer of rho, its bias left
/// out. The last layer of phi and V have no ReLU.
/// @throws std::out_of_range if NET has no such part; std::invalid_argument if rho has no hidden layer.
std::vector<HiddenLayer> term_layers(const files::Network& network, const files::FunctionId& phi,
                                     const files::FunctionId& rho);

/// x -> rho(phi(x) + s) of "set:<phi kind>:<rho kind>", for any s with least <= V s <= most; V as in term_layers().
/// What takes the place of rho, a tree's forms say.
/// @throws as local_function() and term_layers().
LocalFunction coupled_function(const files::Network& network, const files::FunctionId& function,
                               const std::string& block, const std::vector<double>& scale,
                               const std::vector<double>& least, const std::vector<double>& most);

}  // namespace swarmcert::check
