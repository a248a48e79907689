/// @file The kinds of a vehicle and its neighbours: "large+small>small" is a small one among a large and a small one.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "nn/weights/function_id.h"
#include "nn/weights/network.h"

namespace swarmcert::files {

/// Returns the name: the neighbours' kinds in alphabetical order, then the vehicle's own; ">small" has no neighbours.
std::string composition_name(std::vector<std::string> neighbours, const std::string& own);

/// Returns the neighbour kinds of NET in the order of their indices in a DeepSet, without the ground.
std::vector<std::string> neighbour_kinds(const Network& network);

/// Returns the names of all compositions for which NET is silent.
std::vector<std::string> silent_compositions(const Network& network);

/// Returns the number of neighbours of each kind in every composition of rho `own` for which NET is silent, as a matrix
/// [compositions x neighbour_kinds()] for DeepSet::silent.
std::vector<int> silent_counts(const Network& network, const std::string& own);

/// Returns whether `function` is a set function that is 0 for some compositions. Such a function does not equal rho of
/// a sum everywhere: bounds on its slope hold while the neighbours stay the same, and it jumps when an arriving or
/// leaving neighbour makes the composition silent or stops it from being so.
bool is_ever_silent(const Network& network, const FunctionId& function);

/// Returns whether NET is silent for exactly these neighbours ("phi:<kind>" each; an entry for the ground is ignored),
/// so that the set function `function` is 0.
bool is_silent_among(const Network& network, const FunctionId& function,
                     const std::vector<FunctionId>& parts);

/// Returns the number of silent compositions that consist of at most `most` neighbours, all of the set function's kind.
long silent_up_to(const Network& network, const FunctionId& function, long most);

/// Returns the compositions that are not silent but become silent when one neighbour of the set function's kind arrives
/// or leaves: the sorted neighbours of each, as "phi:<kind>". There the function jumps by its full value.
std::set<std::vector<FunctionId>> beside_silent(const Network& network, const FunctionId& function);

}  // namespace swarmcert::files
