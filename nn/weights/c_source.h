/// @file Networks as C source: the layout that the networks' authors generate for the firmware.
#pragma once

#include <map>
#include <string>

#include "nn/weights/weights.h"

namespace swarmcert::files {

/// True if `bytes` are text that begins, after comments and preprocessor lines, with a struct or a static object.
bool looks_like_c_source(const std::string& bytes);

/// The network `key` of the C source in `bytes`; `path` for messages.
///
/// The file holds, for each network NAME, a type and one object of it with designated initialisers:
///   struct TYPE { float fc1_weight[inputs][outputs]; float fc1_bias[outputs]; ... };
///   static const struct TYPE weights_NAME = { .fc1_weight = {{...}, ...}, .fc1_bias = {...}, ... };
/// Matrices are transposed against ours. The numbers are those that a compiler stores: for float members, a decimal
/// without the suffix f is rounded to double first and then to float.
/// @param key NAME; may be empty where the file holds one network.
/// @throws InputError with the line if the text is anything else, `key` is not in it, or as assemble().
Weights parse_c_source(const std::string& bytes, const std::string& path, const std::string& key,
                       const std::vector<std::string>& order);

/// Every network of C source of that layout that holds nothing else, by NAME.
/// @throws InputError as parse_c_source(); also for preprocessor lines other than `include` and `pragma`, and for
///   continued lines, after which a compiler may read another text.
std::map<std::string, Weights> parse_pure_c_source(const std::string& bytes, const std::string& path);

}  // namespace swarmcert::files
