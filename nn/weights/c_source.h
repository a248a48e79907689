/// @file Networks as C source: the format that the networks' authors generate for the firmware.
#pragma once

#include <map>
#include <string>

#include "nn/weights/weights.h"

namespace swarmcert::files {

/// Returns true if `bytes` are text that begins with a struct or static object, after comments and preprocessor lines.
bool looks_like_c_source(const std::string& bytes);

/// Parses the network `key` of the C source in `bytes`; `path` is used in messages only.
///
/// For each network NAME, the file contains a type and one object of that type with designated initialisers:
///   struct TYPE { float fc1_weight[inputs][outputs]; float fc1_bias[outputs]; ... };
///   static const struct TYPE weights_NAME = { .fc1_weight = {{...}, ...}, .fc1_bias = {...}, ... };
/// The matrices are the transposes of ours. The values are those that a compiler stores: for float members, a decimal
/// without the suffix f is rounded first to double and then to float.
/// @param key NAME; may be empty if the file contains a single network.
/// @throws InputError with the line if the text is anything else or does not contain `key`, or as assemble().
Weights parse_c_source(const std::string& bytes, const std::string& path, const std::string& key,
                       const LayerChoice& choice);

/// Parses all networks, by NAME, of C source of that format that contains nothing else.
/// @throws InputError as parse_c_source(); also for preprocessor lines other than `include` and `pragma`, and for line
///   continuations, which could make a compiler read different text.
std::map<std::string, Weights> parse_pure_c_source(const std::string& bytes, const std::string& path);

}  // namespace swarmcert::files
