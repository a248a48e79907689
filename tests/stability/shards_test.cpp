#include "stability/sweep/shards.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <string>

#include "data.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "nn/temp_folder.h"

namespace swarmcert::stability {
namespace {

/// Writes a grid of `steps` x 3 cells, and the files that it names, into `folder`.
Grid small_grid(const tests::TempFolder& folder, int steps = 4) {
  files::write_file(folder / "gains.toml",
                    "schema = \"swarmcert/gains/1\"\n[position]\nKp = 10\nKd = 5\nKi = 10\nrate_hz = 500\n",
                    false);
  files::write_file(
      folder / "grid.toml",
      "schema = \"swarmcert/grid/1\"\ngains = \"gains.toml\"\nmodel = \"" +
          tests::source_path("stability/models/crazyflie-small.toml") +
          "\"\naxis = \"z\"\ncompute = [\"amplitude\", \"impulse\"]\npareto = [\"amplitude\", \"impulse\"]\n"
          "[axes]\nKp = {from = 5, to = 20, steps = " +
          std::to_string(steps) + "}\nKd = {from = 3, to = 8, steps = 3}\n",
      false);
  return load_grid(folder / "grid.toml");
}

SweepOptions shard(int index, int count) {
  SweepOptions options;
  options.shard = {index, count};
  options.jobs = 1;
  return options;
}

TEST(Shards, TheSweepHasTheSameBytesHoweverTheGridWasCut) {
  const tests::TempFolder inputs, whole, cut;
  const Grid grid = small_grid(inputs);
  EXPECT_TRUE(run_shard(grid, whole.path(), shard(0, 1)).complete());
  for (const int index : {2, 0, 1}) EXPECT_TRUE(run_shard(grid, cut.path(), shard(index, 3)).complete());
  const MergedSweep merged = read_shards(cut.path());
  EXPECT_EQ(merged.cells.size(), static_cast<std::size_t>(grid.cells()));
  EXPECT_EQ(merged.files.size(), 3U);
  EXPECT_EQ(sweep_json(merged).dump(), sweep_json(read_shards(whole.path())).dump());
}

TEST(Shards, AStoppedShardIsTakenUpWhereItStopped) {
  const tests::TempFolder inputs, whole, stopped;
  const Grid grid = small_grid(inputs, 400);  // more cells than between two checks of `cancelled`
  run_shard(grid, whole.path(), shard(0, 1));
  std::atomic<bool> stop = false;
  SweepOptions options = shard(0, 1);
  options.cancelled = &stop;
  options.progress = [&stop](long done, long) { stop = done > 0; };
  const SweepOutcome first = run_shard(grid, stopped.path(), options);
  ASSERT_FALSE(first.complete());
  ASSERT_GT(first.done, 0);
  EXPECT_THROW(read_shards(stopped.path()), files::InputError) << "it is incomplete";
  EXPECT_THROW(run_shard(grid, stopped.path(), shard(0, 1)), files::InputError)
      << "nothing is overwritten unasked";
  SweepOptions again = shard(0, 1);
  again.resume = true;
  long least = grid.cells();
  again.progress = [&least](long done, long) { least = std::min(least, done); };
  EXPECT_TRUE(run_shard(grid, stopped.path(), again).complete());
  EXPECT_GT(least, first.done) << "it began anew";
  EXPECT_EQ(sweep_json(read_shards(stopped.path())).dump(), sweep_json(read_shards(whole.path())).dump());
}

TEST(Shards, TheFirstCellOfAMissingShardIsNamed) {
  const tests::TempFolder inputs, folder;
  const Grid grid = small_grid(inputs);
  for (const int index : {0, 2}) run_shard(grid, folder.path(), shard(index, 3));
  try {
    read_shards(folder.path());
    FAIL() << "a shard is missing";
  } catch (const files::InputError& error) {
    EXPECT_NE(std::string(error.what()).find("the first is cell 1"), std::string::npos) << error.what();
  }
}

TEST(Shards, AFolderOfSomeoneElseIsLeftAlone) {
  const tests::TempFolder inputs, folder;
  files::write_file(folder / "thesis.tex", "text", false);
  EXPECT_THROW(run_shard(small_grid(inputs), folder.path(), shard(0, 1)), files::InputError);
  EXPECT_EQ(files::read_file(folder / "thesis.tex"), "text");
}

}  // namespace
}  // namespace swarmcert::stability
