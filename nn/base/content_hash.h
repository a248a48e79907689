/// @file Hash of a JSON document's content, independent of its formatting.
#pragma once

#include <string>

#include "nn/base/json.h"

namespace swarmcert::files {

/// Returns the SHA-256 of the structure, names and values of the object `document`, without its own member
/// "content_sha256". Members are hashed in order of their names and numbers by the 64 bits of their double, so that
/// white space, the order of members and the notation of numbers do not matter. Encoding by type of value:
///   null "n"; true "t"; false "f"; number "d" and 16 hex digits of its bits; string "s", its length in bytes, ":",
///   the bytes; array "[", the elements, "]"; object "{", for each member its name as a string and its value, "}".
/// @throws std::invalid_argument if `document` is not an object.
std::string content_sha256(const Json& document);

}  // namespace swarmcert::files
