/// @file PyTorch's two containers of a pickled state dict.
#pragma once

#include <string>

#include "nn/weights/weights.h"

namespace swarmcert::files {

/// True if `bytes` begin like a zip archive, PyTorch's container since 1.6.
bool looks_like_pth_zip(const std::string& bytes);

/// True if `bytes` begin with the magic number of PyTorch's container before 1.6.
bool looks_like_pth_legacy(const std::string& bytes);

/// Both: `key`, `order` and errors as in load_weights(); `path` for messages. Memory: the file, its opcodes
/// (kMostPickleOperations) and its numbers (kMostElements), whatever sizes it declares.
Weights parse_pth_zip(const std::string& bytes, const std::string& path, const std::string& key,
                      const std::vector<std::string>& order);
Weights parse_pth_legacy(const std::string& bytes, const std::string& path, const std::string& key,
                         const std::vector<std::string>& order);

}  // namespace swarmcert::files
