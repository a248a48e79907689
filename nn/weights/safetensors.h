/// @file safetensors: a JSON header with its length in front, then raw little-endian numbers.
#pragma once

#include <string>
#include <vector>

#include "nn/weights/weights.h"

namespace swarmcert::files {

/// True if `bytes` begin with a header length and a JSON object.
bool looks_like_safetensors(const std::string& bytes);

/// The network in `bytes`; `path` for messages.
/// @throws InputError if the header is not JSON, data overlap, leave gaps or leave the file, or as assemble().
Weights parse_safetensors(const std::string& bytes, const std::string& path,
                          const std::vector<std::string>& order = {});

/// The bytes that save_safetensors() writes.
std::string safetensors_bytes(const Weights& weights);

}  // namespace swarmcert::files
