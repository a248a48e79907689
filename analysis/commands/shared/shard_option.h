/// @file The option --shard of commands whose work can be cut into parts.
#pragma once

#include <cstdlib>
#include <string>

#include "analysis/cli/command.h"
#include "nn/base/shard.h"

namespace swarmcert::analysis {

/// Part N of N is part 0, so that 0/4 .. 3/4 and 1/4 .. 4/4 both cover all.
/// @throws UsageError if `text` is not I/N with 0 <= I <= N.
inline files::Shard parse_shard(const std::string& text) {
  constexpr long kMostParts = 1'000'000;
  const std::size_t slash = text.find('/');
  char* end = nullptr;
  const long index = std::strtol(text.c_str(), &end, 10);
  const bool has_index = slash != std::string::npos && end == text.c_str() + slash && slash > 0;
  const long count = has_index ? std::strtol(text.c_str() + slash + 1, &end, 10) : 0;
  if (!has_index || *end != '\0' || count < 1 || count > kMostParts || index < 0 || index > count)
    throw UsageError("--shard " + text + ": write I/N with 0 <= I <= N, e.g. 2/8");
  return {static_cast<int>(index % count), static_cast<int>(count)};
}

}  // namespace swarmcert::analysis
