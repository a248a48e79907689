/// @file Long computations: split into shards for several machines, and resumable after an interruption.
#pragma once

#include <cstdlib>
#include <functional>
#include <optional>
#include <string>

#include "nn/base/json.h"

namespace swarmcert::files {

/// Shard `index` of `count`: the units whose number modulo `count` is `index`, so that the shards cover each unit once.
struct Shard {
  int index = 0, count = 1;

  bool is_whole() const { return count == 1; }
  bool has(long unit) const { return unit % count == index; }
};

/// Parses "I/N" with 0 <= I <= N and 1 <= N <= 1'000'000; returns nothing for any other text. Shard N of N is shard 0,
/// so that both 0/4 .. 3/4 and 1/4 .. 4/4 cover everything.
inline std::optional<Shard> shard_of(const std::string& text) {
  constexpr long kMostParts = 1'000'000;
  const std::size_t slash = text.find('/');
  char* end = nullptr;
  const long index = std::strtol(text.c_str(), &end, 10);
  const bool has_index = slash != std::string::npos && end == text.c_str() + slash && slash > 0;
  const long count = has_index ? std::strtol(text.c_str() + slash + 1, &end, 10) : 0;
  if (!has_index || *end != '\0' || count < 1 || count > kMostParts || index < 0 || index > count)
    return std::nullopt;
  return Shard{static_cast<int>(index % count), static_cast<int>(count)};
}

/// Returns the result of one unit of work: read from `file` if it is stored there, else computed by `compute` and then
/// written to `file`.
/// @param key text that changes with everything that the result depends on; a file with a different key is replaced.
/// @returns the members of the object that `compute` returned, after "schema" and "key".
/// @throws InputError if the file exists but is not JSON of this schema.
Json kept_unit(const std::string& file, const std::string& schema, const std::string& key,
               const std::function<Json()>& compute);

}  // namespace swarmcert::files
