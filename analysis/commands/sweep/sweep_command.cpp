#include <fmt/core.h>

#include <filesystem>
#include <memory>

#include "analysis/cli/command_line.h"
#include "analysis/cli/host.h"
#include "analysis/cli/progress.h"
#include "analysis/commands/commands.h"
#include "analysis/commands/shared/shard_option.h"
#include "analysis/commands/sweep/sweep_report.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "stability/sweep/shards.h"

namespace swarmcert::analysis {
namespace {

using stability::MergedSweep;

struct SweepOptions {
  std::string grid, folder, shard, report;
  bool resume = false;
};

std::string report_folder(const std::string& folder, const std::string& report) {
  return report.empty() ? (std::filesystem::path(folder) / "report").string() : report;
}

/// Of a whole sweep, or of one shard.
struct SweepResult {
  std::optional<MergedSweep> sweep;
  stability::SweepOutcome shard;
};

void describe(files::Record& record, const SweepResult& result) {
  record.may_object(!result.sweep, "shard", "With --shard: what was computed.", [&](files::Record& shard) {
    shard.field("file", result.shard.file, "Where the cells are.");
    shard.field("cells", result.shard.done, "Their number.");
  });
  record.may_fields(result.sweep.has_value(),
                    [&](files::Record& all) { describe(all, result.sweep.value_or(MergedSweep())); });
}

/// A grid gives a picture, `tune` the best gains between its values. Shards may be merged where the grid is not: then
/// there is no next command.
void print_next_of(const std::string& grid_path, const CommonOptions& common) {
  try {
    const stability::Grid grid = stability::load_grid(grid_path);
    print_next(common, {"tune", "--gains", grid.gains.path, "--model", grid.model.path, "--axis",
                        std::string(1, "xyz"[grid.axis])});
  } catch (const files::InputError&) {
    return;
  }
}

/// Writes FOLDER/sweep.json and the report; the last step of both commands.
int finish(const std::string& command, const std::string& folder, const std::string& report_wanted,
           const std::vector<std::string>& inputs, const CommonOptions& common, bool may_replace) {
  const MergedSweep sweep = stability::read_shards(folder);
  const std::string path = (std::filesystem::path(folder) / "sweep.json").string();
  const std::string text = files::to_text(sweep_json(sweep));
  const bool is_there = std::filesystem::exists(path) && files::read_file(path) == text;
  if (!is_there) files::write_file(path, text, common.force || may_replace);
  const std::string report = write_sweep_report(sweep, report_folder(folder, report_wanted),
                                                common.force || may_replace || is_there);
  write_result(common, result_of(command, command == "merge" ? sweep.files : inputs, std::nullopt, sweep));
  if (!common.prints_text()) return kDone;
  print_sweep(sweep);
  fmt::print("\npoints: {}\nreport: {}\n", path, report);
  print_next_of(sweep.grid.path, common);
  return kDone;
}

int run_sweep(const SweepOptions& options, const CommonOptions& common) {
  refuse_to_replace(common, common.json);
  refuse_folder(common, options.report);
  if (options.shard.empty() && !options.resume)
    refuse_folder(common, report_folder(options.folder, options.report));
  const stability::Grid grid = stability::load_grid(options.grid);
  stability::SweepOptions sweep;
  sweep.shard = parse_shard(options.shard.empty() ? "0/1" : options.shard);
  sweep.resume = options.resume;
  sweep.overwrite = common.force;
  sweep.jobs = common.jobs;
  Progress progress(common.quiet);
  sweep.progress = [&progress](long done, long total) {
    progress.show(static_cast<int>(done), static_cast<int>(total), "cells");
  };
  const CancelOnInterrupt interrupt;
  sweep.cancelled = interrupt.flag();
  const stability::SweepOutcome outcome = run_shard(grid, options.folder, sweep);
  if (!outcome.complete()) {
    note(fmt::format("swarmcert: interrupted after {} of {} cells, kept in {}; --resume continues",
                     outcome.done, outcome.total, outcome.file));
    return kInconclusive;
  }
  if (sweep.shard.is_whole())
    return finish("sweep", options.folder, options.report, grid.inputs, common, options.resume);
  write_result(common, result_of("sweep", grid.inputs, std::nullopt, SweepResult{std::nullopt, outcome}));
  if (common.prints_text()) {
    fmt::print("{} cells in {}; when all shards are there, merge them.\n", outcome.done, outcome.file);
    print_next(common, {"merge", options.folder});
  }
  return kDone;
}

}  // namespace

Command sweep_command() {
  return {"sweep", "Bounds over a grid of gains and vehicles: tables, heatmaps, Pareto front",
          "Writes shard files, points as sweep.json, and a report with heatmaps into the folder. Cells that "
          "are not\n"
          "feasible state the reason. --shard I/N computes every N-th cell: a job array runs one shard per "
          "task, and\n"
          "'swarmcert merge' turns them into the bytes of an undivided run. Ctrl-C keeps the cells computed "
          "so far.\n\n"
          "Example: swarmcert sweep grid.toml -o sweep",
          [](CLI::App& app) {
            const auto options = std::make_shared<SweepOptions>();
            app.add_option("GRID", options->grid, "grid.toml: axes and what to compute")->required();
            add_output(app, "-o,--output", options->folder, "Folder for the results")->required();
            add_output(app, "--report", options->report,
                       "Folder for the report (default: report in that folder)");
            app.add_option("--shard", options->shard,
                           "I/N: compute only part I of N, counted from 0 or from 1 (part N is part 0)");
            leave_out_of_record(app.add_flag("--resume", options->resume,
                                             "Keep the cells that the shard's file already contains"));
            return [options](const CommonOptions& common) { return run_sweep(*options, common); };
          },
          fields_of<SweepResult>()};
}

Command merge_command() {
  return {
      "merge", "Merge the shards of a sweep",
      "Checks that every cell is present exactly once, then writes the same bytes as an undivided sweep.\n\n"
      "Example: swarmcert merge sweep",
      [](CLI::App& app) {
        const auto options = std::make_shared<SweepOptions>();
        app.add_option("DIR", options->folder, "Folder with the shard files")->required();
        add_output(app, "--report", options->report,
                   "Folder for the report (default: report in that folder)");
        return [options](const CommonOptions& common) {
          refuse_to_replace(common, common.json);
          refuse_folder(common, options->report);
          return finish("merge", options->folder, options->report, {}, common, false);
        };
      },
      fields_of<MergedSweep>()};
}

}  // namespace swarmcert::analysis
