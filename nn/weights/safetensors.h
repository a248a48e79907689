/// @file safetensors: the length of a JSON header, the header, then raw little-endian numbers.
#pragma once

#include <string>
#include <vector>

#include "nn/weights/weights.h"

namespace swarmcert::files {

/// Returns true if `bytes` begin with a header length and a JSON object.
bool looks_like_safetensors(const std::string& bytes);

/// Parses the network in `bytes`; `path` is used in messages only.
/// @throws InputError if the header is not JSON, if data overlap, leave gaps or exceed the file, or as assemble().
Weights parse_safetensors(const std::string& bytes, const std::string& path, const LayerChoice& choice = {});

/// Returns the bytes that save_safetensors() writes.
std::string safetensors_bytes(const Weights& weights);

}  // namespace swarmcert::files
