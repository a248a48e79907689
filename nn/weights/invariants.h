/// @file Networks whose phi take rotation invariants of a neighbour's state (nn/invariants.h).
#pragma once

#include <string>
#include <vector>

#include "nn/invariants.h"
#include "nn/weights/network.h"

namespace swarmcert::files {

/// Returns the names of the inputs of the invariants, in order: "dp_x_m" .. "dv_z_m_s".
const std::vector<std::string>& relative_state();
/// Return the names of the invariants, of a neighbour and of the vehicle's own state.
const std::vector<std::string>& neighbour_invariant_names();
const std::vector<std::string>& own_invariant_names();

/// Returns whether `function` takes states but its phi invariants: the set functions of a network with invariants.
bool maps_to_invariants(const Network& network, const FunctionId& function);

/// Returns the exact Lipschitz constant, in Euclidean norms, of the map from the inputs of `function` to those of its
/// first layer: 3/2 or 1 if it maps to invariants, else 1.
double slope_of_inputs(const Network& network, const FunctionId& function);

/// Returns the invariants of a state that are the inputs of `phi`, computed in rounded double arithmetic.
/// @param state [kOwnState] for the ground's phi, else [kRelativeState].
std::vector<double> invariants_of(const FunctionId& phi, const std::vector<double>& state);

/// @throws InputError if NET has invariants; `what` names what supports only networks of relative states.
void require_relative_states(const Network& network, const std::string& what);

}  // namespace swarmcert::files
