/// @file PyTorch's two container formats for a pickled state dict.
#pragma once

#include <string>

#include "nn/weights/weights.h"

namespace swarmcert::files {

/// Returns true if `bytes` begin like a zip archive, PyTorch's container since 1.6.
bool looks_like_pth_zip(const std::string& bytes);

/// Returns true if `bytes` begin with the magic number of PyTorch's container before 1.6.
bool looks_like_pth_legacy(const std::string& bytes);

/// Parse the two containers. `key`, `order` and errors are as in load_weights(); `path` is used in messages only.
/// Memory is limited to the file, its opcodes (kMostPickleOperations) and its numbers (kMostElements), whatever sizes
/// the file declares.
Weights parse_pth_zip(const std::string& bytes, const std::string& path, const std::string& key,
                      const LayerChoice& choice);
Weights parse_pth_legacy(const std::string& bytes, const std::string& path, const std::string& key,
                         const LayerChoice& choice);

}  // namespace swarmcert::files
