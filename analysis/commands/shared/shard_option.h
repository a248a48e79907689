/// @file The option --shard of commands whose work can be split.
#pragma once

#include <string>

#include "analysis/cli/command.h"
#include "nn/base/shard.h"

namespace swarmcert::analysis {

/// @throws UsageError if `text` is not I/N with 0 <= I <= N; see files::shard_of().
inline files::Shard parse_shard(const std::string& text) {
  if (const auto shard = files::shard_of(text)) return *shard;
  throw UsageError("--shard " + text + ": write I/N with 0 <= I <= N, e.g. 2/8");
}

}  // namespace swarmcert::analysis
