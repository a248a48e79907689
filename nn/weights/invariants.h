/// @file Networks whose phi see rotation invariants of the state of a neighbour (nn/invariants.h).
#pragma once

#include <string>
#include <vector>

#include "nn/invariants.h"
#include "nn/weights/network.h"

namespace swarmcert::files {

/// Names of what invariants are made from, in their order: "dp_x_m" .. "dv_z_m_s".
const std::vector<std::string>& relative_state();
/// Names of the invariants themselves, of a neighbour and of the vehicle's own state.
const std::vector<std::string>& neighbour_invariant_names();
const std::vector<std::string>& own_invariant_names();

/// Whether `function` takes states, and its phi invariants of them: the set functions of a network with invariants.
bool maps_to_invariants(const Network& network, const FunctionId& function);

/// Lipschitz constant, in Euclidean norms, of the map from the inputs of `function` to those of its first layer, exact:
/// 3/2 or 1 where it maps to invariants, else 1.
double slope_of_inputs(const Network& network, const FunctionId& function);

/// Invariants of a state, as part `phi` of a network with invariants sees them, in double, rounded.
/// @param state [kOwnState] for the ground's phi, else [kRelativeState].
std::vector<double> invariants_of(const FunctionId& phi, const std::vector<double>& state);

/// @throws InputError if NET has invariants; `what` says what is for networks of relative states only.
void require_relative_states(const Network& network, const std::string& what);

}  // namespace swarmcert::files
