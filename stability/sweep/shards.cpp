#include "stability/sweep/shards.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>
#include <variant>

#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "nn/base/parallel.h"

namespace swarmcert::stability {
namespace {

using files::InputError;
using files::Json;
namespace fs = std::filesystem;

constexpr char kShardSchema[] = "swarmcert/sweep-shard/1";
constexpr char kPointsSchema[] = "swarmcert/sweep-points/1";
constexpr int kBlock = 512;  ///< cells between two checks of the clock and of Ctrl-C
constexpr double kCheckpoint_s = 5;

double number_of(const Json& json) {
  if (json.is_number()) return json.get<double>();
  const std::string text = json.get<std::string>();
  return text == "nan" ? NAN : text == "inf" ? INFINITY : -INFINITY;
}

/// JSON has no infinity and no NaN; both occur (no bound, no sampled loop) and must be preserved.
using ExactNumber = std::variant<double, std::string>;

ExactNumber exact_number(double value) {
  if (std::isfinite(value)) return value;
  return std::isnan(value) ? "nan" : value > 0 ? "inf" : "-inf";
}

void describe_axis(files::Record& record, const GridAxis& axis) {
  record.field("name", axis.name, "Of the parameter.");
  record.field("values", axis.values, "In the unit of the parameter.");
}

void describe_cell(files::Record& record, const Cell& cell) {
  std::vector<ExactNumber> values;
  for (const double value : cell.values) values.push_back(exact_number(value));
  record.field("index", cell.index, "Number of the cell, from 0; the last axis varies fastest.");
  record.field("values", values, "What was computed, in the order of `compute`.");
  record.field("infeasible", cell.infeasible, "Why the cell is not feasible; empty if it is.");
}

void describe_shard(files::Record& record, const Grid& grid, const files::Shard& shard,
                    const std::vector<Cell>& cells) {
  record.constant("schema", kShardSchema, "Name and version of this format.");
  record.field("grid", grid.path, "The grid.toml.");
  record.field("grid_sha256", grid.sha256, "SHA-256 of the grid.toml.");
  record.field("gains_sha256", grid.gains.sha256, "SHA-256 of the gains.toml.");
  record.field("model_sha256", grid.model.sha256, "SHA-256 of the model.toml.");
  record.list("axes", grid.axes, "The varied parameters in the order of the grid.", describe_axis);
  record.field("compute", grid.compute, "What was computed in every cell.");
  record.field("pareto", grid.pareto, "The quantities that span the Pareto front.");
  record.field("shard", shard.index, "Number of this part, from 0.");
  record.field("count", shard.count, "Number of parts.");
  record.field("total", grid.cells(), "Number of cells of the whole grid.");
  record.list("cells", cells, "The cells of this part.", describe_cell);
}

Json shard_json(const Grid& grid, const files::Shard& shard, const std::map<long, Cell>& done) {
  std::vector<Cell> cells;
  for (const auto& [index, cell] : done) cells.push_back(cell);
  files::Node node;
  files::Record record(node, false);
  describe_shard(record, grid, shard, cells);
  return files::to_json(node);
}

Cell cell_of(const Json& json) {
  Cell cell;
  cell.index = json.at("index").get<long>();
  for (const Json& value : json.at("values")) cell.values.push_back(number_of(value));
  cell.infeasible = json.at("infeasible").get<std::string>();
  return cell;
}

void write_shard(const std::string& file, const Grid& grid, const files::Shard& shard,
                 const std::map<long, Cell>& done) {
  files::write_file(file, shard_json(grid, shard, done).dump() + "\n", true);
}

bool same_grid(const Json& a, const Json& b) {
  for (const char* key :
       {"grid_sha256", "gains_sha256", "model_sha256", "axes", "compute", "pareto", "total"}) {
    if (a.at(key) != b.at(key)) return false;
  }
  return true;
}

/// Converts missing members and wrong types to InputError.
template <class Read>
auto reading(const std::string& file, const Read& read) {
  try {
    return read();
  } catch (const Json::exception& error) {
    throw InputError({file, "", "", "", std::string("is not a shard of a sweep (") + error.what() + ")",
                      "recompute it with --force"});
  }
}

/// Rejects a folder that contains files but nothing of a sweep. Shards may start simultaneously, so files that are
/// still being written count as well.
void refuse_foreign(const std::string& folder) {
  if (!fs::is_directory(folder) || fs::is_empty(folder)) return;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (name.find("shard-") != std::string::npos || name.rfind("sweep", 0) == 0 ||
        name.rfind("swarmcert-sweep", 0) == 0) {
      return;
    }
  }
  throw InputError({folder, "", "", "", "is not empty, and contains nothing of a sweep",
                    "choose another folder, or add files to this one with --force"});
}

/// Returns the shard files in alphabetical order; at least one.
std::vector<std::string> shard_files(const std::string& folder) {
  std::vector<std::string> paths;
  if (fs::is_directory(folder)) {
    for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
      const std::string name = entry.path().filename().string();
      if (name.rfind("shard-", 0) == 0 && entry.path().extension() == ".json")
        paths.push_back(entry.path().string());
    }
  }
  std::sort(paths.begin(), paths.end());
  if (paths.empty()) {
    throw InputError(
        {folder, "", "", "", "contains no shard of a sweep", "swarmcert sweep GRID.toml -o " + folder});
  }
  return paths;
}

}  // namespace

SweepOutcome run_shard(const Grid& grid, const std::string& folder, const SweepOptions& options) {
  SweepOutcome outcome;
  outcome.file = (fs::path(folder) / ("shard-" + std::to_string(options.shard.index) + "-of-" +
                                      std::to_string(options.shard.count) + ".json"))
                     .string();
  if (!options.overwrite) refuse_foreign(folder);
  std::map<long, Cell> done;
  if (fs::exists(outcome.file)) {
    if (options.resume) {
      const Json old = files::read_json(outcome.file, kShardSchema);
      reading(outcome.file, [&] {
        if (!same_grid(old, shard_json(grid, options.shard, {}))) {
          throw InputError({outcome.file, "", "grid_sha256", "", "belongs to another grid, gains or model",
                            "--force recomputes it"});
        }
        for (const Json& json : old.at("cells")) {
          Cell cell = cell_of(json);
          done.emplace(cell.index, std::move(cell));
        }
        return 0;
      });
    } else if (!options.overwrite) {
      throw InputError(
          {outcome.file, "", "", "", "the file exists", "--resume continues it, --force replaces it"});
    }
  }
  fs::create_directories(folder);
  std::vector<long> todo;
  for (long i = 0; i < grid.cells(); ++i) {
    if (!options.shard.has(i)) continue;
    ++outcome.total;
    if (done.count(i) == 0) todo.push_back(i);
  }
  const auto is_cancelled = [&options] { return options.cancelled != nullptr && *options.cancelled; };
  auto saved = std::chrono::steady_clock::now();
  for (std::size_t begin = 0; begin < todo.size() && !is_cancelled(); begin += kBlock) {
    const std::size_t size = std::min<std::size_t>(kBlock, todo.size() - begin);
    std::vector<Cell> block(size);
    files::parallel_for(static_cast<int>(size), options.jobs, [&](int i) {
      block[static_cast<std::size_t>(i)] = compute_cell(grid, todo[begin + static_cast<std::size_t>(i)]);
    });
    for (Cell& cell : block) done.emplace(cell.index, std::move(cell));
    if (options.progress) options.progress(static_cast<long>(done.size()), outcome.total);
    const auto now = std::chrono::steady_clock::now();
    if (std::chrono::duration<double>(now - saved).count() > kCheckpoint_s) {
      write_shard(outcome.file, grid, options.shard, done);
      saved = now;
    }
  }
  write_shard(outcome.file, grid, options.shard, done);
  outcome.done = static_cast<long>(done.size());
  return outcome;
}

MergedSweep read_shards(const std::string& folder) {
  const std::vector<std::string> paths = shard_files(folder);
  Json first;
  std::map<long, Cell> cells;
  for (const std::string& path : paths) {
    const Json shard = files::read_json(path, kShardSchema);
    reading(path, [&] {
      if (first.is_null()) first = shard;
      if (!same_grid(first, shard)) {
        throw InputError({path, "", "grid_sha256", "", "belongs to another grid than " + paths.front(),
                          "keep one sweep per folder"});
      }
      for (const Json& json : shard.at("cells")) {
        Cell cell = cell_of(json);
        const long index = cell.index;
        if (!cells.emplace(index, std::move(cell)).second) {
          throw InputError({path, "", "cells", std::to_string(index), "is a cell of two shards",
                            "keep only shards with the same number of shards"});
        }
      }
      return 0;
    });
  }
  MergedSweep sweep;
  sweep.files = paths;
  const long total = reading(paths.front(), [&] {
    sweep.grid.path = first.at("grid").get<std::string>();
    sweep.grid.sha256 = first.at("grid_sha256").get<std::string>();
    for (const Json& axis : first.at("axes"))
      sweep.grid.axes.push_back(
          {axis.at("name").get<std::string>(), axis.at("values").get<std::vector<double>>()});
    sweep.grid.compute = first.at("compute").get<std::vector<std::string>>();
    sweep.grid.pareto = first.at("pareto").get<std::vector<std::string>>();
    return first.at("total").get<long>();
  });
  for (long i = 0; i < total; ++i) {
    if (cells.count(i) == 1) continue;
    throw InputError({folder, "", "cells", std::to_string(total - static_cast<long>(cells.size())),
                      "of " + std::to_string(total) + " are missing; the first is cell " + std::to_string(i),
                      "run its shard with --resume"});
  }
  for (auto& [index, cell] : cells) sweep.cells.push_back(std::move(cell));
  sweep.front = pareto_front(sweep.grid, sweep.cells);
  return sweep;
}

namespace {

using NamedNumbers = std::vector<std::pair<std::string, double>>;

/// A cell with the names of its numbers.
struct Point {
  long index = 0;
  NamedNumbers at, values;
  std::string infeasible;
  bool is_in_front = false;
};

NamedNumbers named(const std::vector<std::string>& names, const std::vector<double>& values) {
  NamedNumbers result;
  for (std::size_t i = 0; i < names.size(); ++i) result.emplace_back(names[i], values[i]);
  return result;
}

std::vector<Point> points_of(const MergedSweep& sweep) {
  const std::set<long> front(sweep.front.begin(), sweep.front.end());
  std::vector<std::string> axes;
  for (const GridAxis& axis : sweep.grid.axes) axes.push_back(axis.name);
  std::vector<Point> points;
  for (const Cell& cell : sweep.cells)
    points.push_back({cell.index, named(axes, sweep.grid.at(cell.index)),
                      named(sweep.grid.compute, cell.values), cell.infeasible, front.count(cell.index) == 1});
  return points;
}

void describe_point(files::Record& record, const Point& point) {
  std::vector<std::pair<std::string, std::optional<double>>> values;
  for (const auto& [name, value] : point.values)
    values.emplace_back(name, std::isfinite(value) ? std::optional<double>(value) : std::nullopt);
  record.field("index", point.index, "Number of the cell, from 0; the last axis varies fastest.");
  record.field("at", point.at, "Value of each varied parameter.");
  record.field("values", values, "What was computed; null: infinite or not defined.");
  record.field("feasible", point.infeasible.empty(), "Whether the cell satisfies the limits of the grid.");
  record.field("reason", point.infeasible, "Why it is not feasible; empty if it is.");
  record.field("pareto", point.is_in_front, "Whether no other feasible cell is better in everything.");
}

void describe_file(files::Record& record, const MergedSweep& sweep) {
  record.constant("schema", kPointsSchema, "Name and version of this format.");
  record.field("grid", sweep.grid.path, "The grid.toml.");
  record.field("grid_sha256", sweep.grid.sha256, "SHA-256 of the grid.toml.");
  describe(record, sweep);
}

}  // namespace

void describe(files::Record& record, const MergedSweep& sweep) {
  record.list("axes", sweep.grid.axes, "The varied parameters in the order of the grid.", describe_axis);
  record.field("compute", sweep.grid.compute, "What was computed in every cell.");
  record.field("pareto", sweep.grid.pareto, "The quantities that span the Pareto front.");
  record.list("points", points_of(sweep), "Every cell of the grid.", describe_point);
}

Json sweep_json(const MergedSweep& sweep) {
  files::Node node;
  files::Record record(node, false);
  describe_file(record, sweep);
  return files::to_json(node);
}

void describe_points_file(files::Record& record) { describe_file(record, {}); }

void describe_shard_file(files::Record& record) { describe_shard(record, {}, {}, {}); }

}  // namespace swarmcert::stability
