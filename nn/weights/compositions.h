/// @file Which kinds of vehicles are together: "large+small>small" is a small one among a large and a small one.
#pragma once

#include <string>
#include <vector>

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
/// whole: bounds hold while the neighbours stay the same, and nothing bounds the step where one comes or goes.
bool is_ever_silent(const Network& network, const std::string& function);

/// @throws InputError if NET is silent in some composition; `what` says what is for networks that never are.
void require_never_silent(const Network& network, const std::string& what);

}  // namespace swarmcert::files
