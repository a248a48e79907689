#include "analysis/commands/schema/file_kinds.h"

#include "stability/sweep/shards.h"

namespace swarmcert::analysis {

const std::vector<FileKind>& file_kinds() {
  static const std::vector<FileKind> all = {
      {"sweep-points", "Points of a sweep", "sweep.json of `sweep` and `merge`.",
       stability::describe_points_file},
      {"sweep-shard", "One part of a sweep", "File of one part of `sweep --shard`.",
       stability::describe_shard_file},
  };
  return all;
}

}  // namespace swarmcert::analysis
