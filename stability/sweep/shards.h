/// @file Sharded sweeps: each shard writes one file; the merge checks completeness.
#pragma once

#include <atomic>
#include <functional>
#include <string>
#include <vector>

#include "nn/base/json.h"
#include "nn/base/record.h"
#include "nn/base/shard.h"
#include "stability/sweep/grid.h"

namespace swarmcert::stability {

struct SweepOptions {
  files::Shard shard;   ///< which of the grid's cells to compute
  bool resume = false;  ///< keep the cells that the shard's file already has
  bool overwrite = false;
  int jobs = 0;
  const std::atomic<bool>* cancelled = nullptr;
  std::function<void(long done, long total)> progress;
};

struct SweepOutcome {
  std::string file;  ///< written by the shard
  long done = 0;     ///< cells in the file
  long total = 0;    ///< cells that belong to it
  bool complete() const { return done == total; }
};

/// Computes the cells of one shard and writes FOLDER/shard-I-of-N.json. Every few seconds, and when cancelled, it
/// writes the cells computed so far (atomically). The file's bytes depend on the grid and the shard only.
/// @throws files::InputError if the file exists and neither resume nor overwrite is set, if it belongs to another grid,
///     or if the folder holds other files but nothing of a sweep and overwrite is not set.
SweepOutcome run_shard(const Grid& grid, const std::string& folder, const SweepOptions& options);

/// A whole sweep, read back from its shards.
struct MergedSweep {
  std::vector<std::string> files;  ///< the shards
  Grid grid;                       ///< path, sha256, axes, compute and pareto alone
  std::vector<Cell> cells;         ///< every cell of the grid, by index
  std::vector<long> front;
};

/// Reads every shard in `folder`.
/// @throws files::InputError if shards are missing, incomplete, overlapping or from different grids; the message names
///     them and the missing cells.
MergedSweep read_shards(const std::string& folder);

/// Describes the axes and all cells.
void describe(files::Record& record, const MergedSweep& sweep);

/// Describe sweep.json and the files of the shards, from default values.
void describe_points_file(files::Record& record);
void describe_shard_file(files::Record& record);

/// Returns the sweep as JSON (schema swarmcert/sweep-points/1): the same bytes for any number of shards.
files::Json sweep_json(const MergedSweep& sweep);

}  // namespace swarmcert::stability
