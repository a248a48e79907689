/// @file The functions of NET as chains of exact matrices separated by activations with slopes in [0, 1]. Not for
/// users.
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

/// Returns the exact stages M_1 .. M_K of `function` ("network", "phi:<kind>", "rho:<kind>",
/// "set:<phi kind>:<rho kind>"), restricted to the input coordinates of `block`, each in units of its `scale` (empty:
/// 1). In a set function the last layer of phi and the first layer of rho, which no activation separates, form one
/// stage: their product.
///
/// An activation with slopes in [0, b] is b times one with slopes in [0, 1], so the stage behind it is multiplied by b;
/// b = 1 for ReLU.
/// @throws std::domain_error if an activation of `function` sorts or is not monotone, see bent_chain();
///   std::out_of_range or std::invalid_argument if NET has no such function or block, or `scale` does not have one
///   number per input.
std::vector<Matrix> stages(const files::Network& network, const files::FunctionId& function,
                           const std::string& block = "all", const std::vector<double>& scale = {});

/// The same for any activations, with the slope range of each hidden neuron: [0, 1] after division by the largest
/// slope, or [1 - c, c] with c > 1, which is not divided; or with groups where a layer is sorted, adjacent ones: rows
/// and columns that MaxMin compares across the layer change places.
/// @throws as stages(), except that activations need not be monotone.
BentChain bent_chain(const files::Network& network, const files::FunctionId& function,
                     const std::string& block = "all", const std::vector<double>& scale = {});

/// The same for inputs in `box`, with no activation divided by its largest slope. The neurons of the plain network or
/// phi have the slopes of slopes_on_box(). The neurons of rho have the global slope range of their activation, because
/// the other terms of the sum may be anything.
/// @param box range of the inputs of "network" or "phi:<kind>" after the clamp.
/// @throws as bent_chain(); std::domain_error for "rho:<kind>", which has no box.
BentChain chain_on_box(const files::Network& network, const files::FunctionId& function,
                       const std::string& block, const std::vector<double>& scale, const Intervals& box);

/// Returns an upper bound on the product over the layers of `weights` of the steepest activation slope of each layer,
/// for inputs in `box`.
Dyadic steepest_on_box(const files::Weights& weights, const Intervals& box);

/// Returns "network" or "phi:<kind>", followed by |.|^2 or by the form Q, exactly, in the form used by proofs on a box.
/// @param q [outputs x outputs]; no rows: the identity.
/// @throws as stages(), and std::invalid_argument if the network has no hidden layer or Q has another size.
LocalFunction local_function(const files::Network& network, const files::FunctionId& part,
                             const std::string& block, const std::vector<double>& scale, const Matrix& q);

/// Returns the contribution of `phi` to the values before the first ReLU of `rho`: V phi(x), where V is the first layer
/// of rho without its bias. The last layer of phi and V have no ReLU.
/// @throws std::out_of_range if NET has no such part; std::invalid_argument if rho has no hidden layer.
std::vector<HiddenLayer> term_layers(const files::Network& network, const files::FunctionId& phi,
                                     const files::FunctionId& rho);

/// Returns x -> rho(phi(x) + s) of "set:<phi kind>:<rho kind>", for any s with least <= V s <= most; V as in
/// term_layers(). The forms that replace rho are given by a tree (TreeProof).
/// @throws as local_function() and term_layers().
LocalFunction coupled_function(const files::Network& network, const files::FunctionId& function,
                               const std::string& block, const std::vector<double>& scale,
                               const std::vector<double>& least, const std::vector<double>& most);

}  // namespace swarmcert::check
