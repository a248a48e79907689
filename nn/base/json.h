/// @file JSON as this project reads and writes it: keys in insertion order, floating-point numbers exact.
#pragma once

#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "nn/base/interval.h"

namespace swarmcert::files {

using Json = nlohmann::ordered_json;

/// Returns `value` as a C99 hex float ("0x1.8p+1"), exact and the same on every platform, or "inf", "-inf" or "nan".
std::string hex_float(double value);

/// Inverse of hex_float() for finite values.
/// @throws std::invalid_argument if `text` is not a single, complete, finite C99 hex float that a double represents
///   exactly.
double parse_hex_float(const std::string& text);

/// Returns the numbers of an array of hex floats.
/// @throws std::invalid_argument if `array` is not an array, or as parse_hex_float().
/// @throws Json::exception if an element is not a string.
std::vector<double> parse_hex_floats(const Json& array);

/// @throws std::invalid_argument, prefixed with `where`, unless `object` is an object with exactly these keys.
void require_keys(const Json& object, const std::set<std::string>& keys, const std::string& where);

/// Parses a JSON file and checks its `schema`.
/// @throws InputError with line and column if it is not JSON, is not an object, or has a different schema.
Json read_json(const std::string& path, const std::string& schema);

/// Same as read_json(), but reads from memory; `path` is used in messages only.
Json parse_json(const std::string& text, const std::string& path, const std::string& schema);

/// Parses any JSON value, without a schema.
/// @throws InputError with line and column if it is not JSON, has a duplicate key or is nested more than 64 levels
///   deep.
Json parse_json(const std::string& text, const std::string& path);

/// Returns the text of a JSON document with two-space indentation and a final newline.
std::string to_text(const Json& document);

}  // namespace swarmcert::files

namespace swarmcert {

/// Writes [lower, upper]; found by nlohmann::json through argument-dependent lookup.
inline void to_json(files::Json& json, const Interval& x) { json = files::Json::array({x.lower, x.upper}); }

}  // namespace swarmcert
