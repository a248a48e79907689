/// @file The functions that NET contains, and the stored networks that they are made of.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "nn/weights/function_id.h"
#include "nn/weights/network.h"

namespace swarmcert::files {

/// The stored networks: the plain one, or every phi and every rho.
using Parts = std::map<FunctionId, const Weights*>;
Parts parts(const Network& network);

/// Every function of NET: its parts, then every set function, in order of names.
std::vector<FunctionId> functions(const Network& network);

/// The numbers that `function` takes: of a set function of a network with invariants those of the state, of its phi
/// the invariants.
int inputs(const Network& network, const FunctionId& function);

/// True if NET's input clamp acts on the input of `part`: on every phi but the ground's, and on a plain network.
bool is_clamped(const FunctionId& part);

/// Input coordinates of `function` that belong to `block`, ascending: "all"; "x<k>", the k-th alone, counted from 0;
/// "position" and "velocity", the inputs whose names end in "_m" and "_m_s". Where NET does not name its inputs, six
/// are taken as three of each; the ground's four are one position (-z) and three velocities. A set function of a
/// network with invariants has "all" only: what is proved of J holds for all inputs together.
/// @throws std::invalid_argument if the function has no such block.
std::vector<int> block_coordinates(const Network& network, const FunctionId& function,
                                   const std::string& block);

/// Every block of `function` besides "all": "position" and "velocity" where it has both, then each coordinate; none
/// for a rho, whose inputs have no names, and for a function of one input.
std::vector<std::string> blocks(const Network& network, const FunctionId& function);

/// Unit of a Lipschitz constant of `function` with respect to `block`, as far as NET states units: "gf/(m, m/s)",
/// "gf/m" where all inputs are metres, "hidden/input" where nothing is stated.
std::string unit(const Network& network, const FunctionId& function, const std::string& block = "all");

}  // namespace swarmcert::files
