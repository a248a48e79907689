/// @file Hash of a JSON document's content, independent of its formatting.
#pragma once

#include <string>

#include "nn/base/json.h"

namespace swarmcert::files {

/// SHA-256 over the structure, names and values of the object `document` without its own member "content_sha256".
/// Members enter in order of their names and numbers by the 64 bits of their double, so that neither white space,
/// nor the order of members, nor the notation of a number matters. Encoding, by type of value:
///   null "n"; true "t"; false "f"; number "d" and 16 hex digits of its bits; string "s", its length in bytes, ":",
///   the bytes; array "[", the elements, "]"; object "{", for each member its name as a string and its value, "}".
/// @throws std::invalid_argument if `document` is not an object.
std::string content_sha256(const Json& document);

}  // namespace swarmcert::files
