/// @file Locates the state dict inside a pickled checkpoint.
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "nn/weights/pickle.h"

namespace swarmcert::files {

struct StateDict {
  std::vector<std::pair<std::string, std::size_t>>
      tensors;                      ///< names and indices into Pickle::tensors, in the file's order
  std::vector<std::string> unused;  ///< see Weights::unused
  /// The modules in torch's _metadata, in the order of registration: those without tensors too. Empty: not listed.
  std::vector<std::string> modules;
  std::string key;  ///< the dotted path, if it was not given and the file holds only one state dict
};

/// Returns the state dict at the dotted path `key`. Empty: the top level, or the only state dict in the file if its key
/// is "state_dict" or "model_state_dict", as PyTorch's guides call it. Entries that are no tensors are named as unused.
/// @throws InputError if there is no such key, or if it is not a dict that holds a tensor; the message lists the keys
///   of the state dicts in the file.
StateDict select_state_dict(const Pickle& pickle, const std::string& key, const std::string& path);

}  // namespace swarmcert::files
