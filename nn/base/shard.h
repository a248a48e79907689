/// @file Long work: cut into parts for several machines, and taken up again where it stopped.
#pragma once

#include <cstdlib>
#include <functional>
#include <optional>
#include <string>

#include "nn/base/json.h"

namespace swarmcert::files {

/// Part `index` of `count`: the units whose number leaves this remainder, so that all parts cover each unit once.
struct Shard {
  int index = 0, count = 1;

  bool is_whole() const { return count == 1; }
  bool has(long unit) const { return unit % count == index; }
};

/// "I/N" with 0 <= I <= N <= 1'000'000; nothing for other texts. Part N of N is part 0, so that 0/4 .. 3/4 and
/// 1/4 .. 4/4 both cover all.
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

/// The result of one unit of work: what `file` holds, or else what `compute` returns, which is then written there.
/// @param key text that changes with everything that the result depends on: a file with another one is replaced.
/// @returns the members of the object that `compute` returned, after "schema" and "key".
/// @throws InputError if there is a file that is not JSON of this schema.
Json kept_unit(const std::string& file, const std::string& schema, const std::string& key,
               const std::function<Json()>& compute);

}  // namespace swarmcert::files
