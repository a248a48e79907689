/// @file Locates the state dict inside a pickled checkpoint.
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "nn/weights/pickle.h"

namespace swarmcert::files {

/// Names and indices into Pickle::tensors, in the file's order.
using StateDict = std::vector<std::pair<std::string, std::size_t>>;

/// Returns the state dict at the dotted path `key` (empty: the top level).
/// @throws InputError if there is no such key, if it is not a dict, or if one of its entries is not a tensor; the
///   message lists the keys of the state dicts in the file.
StateDict select_state_dict(const Pickle& pickle, const std::string& key, const std::string& path);

}  // namespace swarmcert::files
