/// @file Which kinds of vehicles are together: "large+small>small" is a small one among a large and a small one.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "nn/weights/function_id.h"
#include "nn/weights/network.h"

namespace swarmcert::files {

/// The kinds of the neighbours in order of names, then the vehicle's own; ">small" is alone.
std::string composition_name(std::vector<std::string> neighbours, const std::string& own);

/// The kinds of neighbours that NET knows, in the order of their indices in a DeepSet: without the ground.
std::vector<std::string> neighbour_kinds(const Network& network);

/// The names of all compositions in which NET is silent.
std::vector<std::string> silent_compositions(const Network& network);

/// Neighbours of each kind in every composition of rho `own` in which NET is silent:
/// [compositions x neighbour_kinds()], as DeepSet::silent takes them.
std::vector<int> silent_counts(const Network& network, const std::string& own);

/// Whether `function` is a set function that is 0 in some compositions. Then it is no composition of rho and a sum as a
/// whole: slopes are bounded while the neighbours stay the same, and it steps where one that comes or goes makes or
/// ends such a composition.
bool is_ever_silent(const Network& network, const FunctionId& function);

/// Whether NET is silent for exactly these neighbours ("phi:<kind>" each, an entry for the ground is ignored), so that
/// the set function `function` is 0.
bool is_silent_among(const Network& network, const FunctionId& function,
                     const std::vector<FunctionId>& parts);

/// How many of the compositions of 0, 1, ... `most` neighbours of the set function's own kind are silent.
long silent_up_to(const Network& network, const FunctionId& function, long most);

/// The compositions with a network from which one neighbour of the set function's own kind comes or goes to a silent
/// one: the neighbours of each, "phi:<kind>", in order of names. The function steps there by all of its value.
std::set<std::vector<FunctionId>> beside_silent(const Network& network, const FunctionId& function);

}  // namespace swarmcert::files
