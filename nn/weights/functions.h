/// @file The functions that NET contains, and the stored networks that they consist of.
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

/// Returns every function of NET: its parts, then every set function, in alphabetical order.
std::vector<FunctionId> functions(const Network& network);

/// Returns the names of the inputs of a phi of relative states, in order: "dp_x_m" .. "dv_z_m_s".
const std::vector<std::string>& relative_state();

/// Returns the number of inputs of `function`.
int inputs(const Network& network, const FunctionId& function);

/// Returns true if NET's input clamp applies to `part`: to every phi except the ground's, and to a plain network.
bool is_clamped(const FunctionId& part);

/// Returns the input coordinates of `function` that belong to `block`, in ascending order: "all"; "x<k>", the k-th
/// coordinate, counted from 0; "position" and "velocity", the inputs whose names end in "_m" and "_m_s". If NET does
/// not name its inputs, six inputs are taken as three of each; the ground's four are one position (-z) and three
/// velocities.
/// @throws std::invalid_argument if the function has no such block.
std::vector<int> block_coordinates(const Network& network, const FunctionId& function,
                                   const std::string& block);

/// Returns every block of `function` except "all": "position" and "velocity" if it has both, then each coordinate.
/// Empty for a rho, whose inputs have no names, and for a function of one input.
std::vector<std::string> blocks(const Network& network, const FunctionId& function);

/// Returns the unit of a Lipschitz constant of `function` with respect to `block`, as far as NET states units: "gf/(m,
/// m/s)", "gf/m" if all inputs are in metres, "hidden/input" if nothing is stated.
std::string unit(const Network& network, const FunctionId& function, const std::string& block = "all");

}  // namespace swarmcert::files
