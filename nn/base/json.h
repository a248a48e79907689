/// @file JSON as this project writes and reads it: keys in the order written, floats exact.
#pragma once

#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "nn/base/interval.h"

namespace swarmcert::files {

using Json = nlohmann::ordered_json;

/// `value` as C99 hex float ("0x1.8p+1"): exact, and the same on every platform. "inf", "-inf", "nan" otherwise.
std::string hex_float(double value);

/// Inverse of hex_float() for finite values.
/// @throws std::invalid_argument if `text` is not one complete, finite C99 hex float that a double holds exactly.
double parse_hex_float(const std::string& text);

/// The numbers of an array of hex floats.
/// @throws std::invalid_argument if it is no array or as parse_hex_float(), Json::exception if an element is not text.
std::vector<double> parse_hex_floats(const Json& array);

/// @throws std::invalid_argument, with `where` in front, unless `object` is an object with exactly these keys.
void require_keys(const Json& object, const std::set<std::string>& keys, const std::string& where);

/// Parses a JSON file and checks `schema`.
/// @throws InputError with line and column if it is not JSON, not an object, or has another schema.
Json read_json(const std::string& path, const std::string& schema);

/// As read_json(), from memory; `path` is used in messages only.
Json parse_json(const std::string& text, const std::string& path, const std::string& schema);

/// Any JSON value, without a schema.
/// @throws InputError with line and column if it is not JSON, has a key twice or is nested more than 64 deep.
Json parse_json(const std::string& text, const std::string& path);

/// Text of a JSON document, two-space indents, final newline.
std::string to_text(const Json& document);

}  // namespace swarmcert::files

namespace swarmcert {

/// [lower, upper], found by nlohmann::json.
inline void to_json(files::Json& json, const Interval& x) { json = files::Json::array({x.lower, x.upper}); }

}  // namespace swarmcert
