#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <filesystem>
#include <limits>
#include <map>
#include <memory>
#include <sstream>

#include "analysis/cli/command_line.h"
#include "analysis/cli/counted.h"
#include "analysis/cli/host.h"
#include "analysis/commands/commands.h"
#include "analysis/commands/inspect/inspect_certificate.h"
#include "analysis/commands/inspect/inspect_log.h"
#include "analysis/commands/inspect/inspect_report.h"
#include "analysis/commands/shared/collection_table.h"
#include "analysis/logs/columns_draft.h"
#include "analysis/logs/read_log.h"
#include "analysis/logs/vehicles_in_file.h"
#include "analysis/residuals/flight_set.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "nn/base/parallel.h"
#include "nn/base/text.h"
#include "nn/base/toml.h"
#include "nn/weights/compositions.h"
#include "nn/weights/functions.h"
#include "stability/model.h"

namespace swarmcert::analysis {
namespace {

struct InspectOptions {
  std::vector<std::string> files;
  files::NetworkArguments network;  ///< key, activation and order of every weight file
  std::string csv;
  std::string columns, columns_draft, report;
  double t0_s = -std::numeric_limits<double>::infinity();
  double t1_s = std::numeric_limits<double>::infinity();
};

/// The operation after layer `k`: the activation; nothing after the last layer.
std::string activation_after(const files::Weights& weights, std::size_t k) {
  return k + 1 < weights.layers.size() ? files::op_after(weights.layers[k]) : "";
}

files::Json describe(const files::Weights& weights) {
  files::Json layers = files::Json::array();
  for (std::size_t k = 0; k < weights.layers.size(); ++k) {
    const files::Layer& layer = weights.layers[k];
    const std::string activation = activation_after(weights, k);
    layers.push_back({{"name", layer.name},
                      {"inputs", layer.inputs},
                      {"outputs", layer.outputs},
                      {"activation", activation.empty() ? files::Json() : files::Json(activation)}});
  }
  return {{"file", weights.path},
          {"sha256", weights.sha256},
          {"precision", files::name(weights.precision)},
          {"activation", weights.layers.size() > 1 ? weights.activation_names() : "relu"},
          {"layers", std::move(layers)},
          {"notes", weights.notes},
          {"rounding_of_slope", files::rounding_of_slope(weights)}};
}

bool is_json(const std::string& path) {
  const std::string text = files::read_file(path);
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  return first != std::string::npos && text[first] == '{';
}

/// The statements of network.toml other than its weights; null where it states nothing.
files::Json description(const files::Network& network) {
  using Gamma = files::GammaStatement;
  files::Json gamma, clamp;
  if (network.gamma) {
    gamma = {{"value", network.gamma->value},
             {"scope", network.gamma->scope == Gamma::Scope::kLayer ? "layer" : "network"},
             {"mode", network.gamma->mode == Gamma::Mode::kClip ? "clip" : "equal"}};
  }
  if (network.clamp) clamp = {{"lower", network.clamp->lower}, {"upper", network.clamp->upper}};
  return {{"output", {{"quantity", network.output_quantity}, {"unit", network.output_unit}}},
          {"gamma", std::move(gamma)},
          {"silent", files::silent_compositions(network)},
          {"input", {{"order", network.input_order}, {"clamp", std::move(clamp)}}}};
}

void print_description(const files::Network& network) {
  if (network.path.empty()) return;
  fmt::print("{}: output {} in {}", network.path,
             network.output_quantity.empty() ? "not stated" : network.output_quantity,
             network.output_unit.empty() ? "no stated unit" : network.output_unit);
  if (network.gamma) {
    const bool is_layer = network.gamma->scope == files::GammaStatement::Scope::kLayer;
    const bool is_clip = network.gamma->mode == files::GammaStatement::Mode::kClip;
    fmt::print("; gamma {} {} per {}", is_clip ? "at most" : "equal to", network.gamma->value,
               is_layer ? "layer" : "network");
  }
  fmt::print("\n");
  const std::vector<std::string>& order = network.input_order;
  for (std::size_t k = 0; k < order.size(); ++k) {
    fmt::print("  input {}: {}", k, order[k]);
    if (network.clamp) fmt::print(", clamped to {} .. {}", network.clamp->lower[k], network.clamp->upper[k]);
    fmt::print("\n");
  }
  for (const std::string& composition : files::silent_compositions(network))
    fmt::print("  silent: {}\n", composition);
}

files::Json inspect_network(const std::string& path, files::NetworkArguments arguments, bool print) {
  arguments.file = path;
  const files::Network network = files::load_any_network(arguments);
  if (print) print_description(network);
  files::Json parts = files::Json::object();
  for (const auto& [part, weights] : files::parts(network)) {
    parts[part.name()] = describe(*weights);
    if (!print) continue;
    fmt::print("{}: {} {}, sha256 {}\n", weights->path, part.name(), files::name(weights->precision),
               weights->sha256);
    for (std::size_t k = 0; k < weights->layers.size(); ++k) {
      const files::Layer& layer = weights->layers[k];
      const std::string activation = activation_after(*weights, k);
      fmt::print("  {:<10} {} -> {}{}{}\n", layer.name, layer.inputs, layer.outputs,
                 activation.empty() ? "" : ", ", activation);
    }
    for (const std::string& note : weights->notes) fmt::print("  {}\n", note);
  }
  files::Json json = {{"file", path}, {"kind", "network"}};
  json.update(description(network));
  json["networks"] = std::move(parts);
  return json;
}

bool is_model(const std::string& path) {
  if (!files::ends_with(path, ".toml")) return false;
  const toml::table document = files::parse_toml(files::read_file(path), path);
  return document["schema"].value_or(std::string()).rfind("swarmcert/model/", 0) == 0;
}

files::Json inspect_model(const std::string& path, bool print) {
  const stability::Model model = stability::read_model(path);
  files::Json effects = files::Json::array();
  for (const stability::EffectSpec& effect : model.effects) {
    effects.push_back({{"effect", effect.name}, {"parameters", effect.parameters}});
    if (!effect.vehicle.empty()) effects.back()["vehicle"] = effect.vehicle;
  }
  const stability::ThrustMap& map = model.thrust;
  if (print) {
    fmt::print("{}: model of kind {}: {} kg, arm {} m, at most {:.3f} N per rotor\n", path, model.kind,
               model.mass_kg, model.arm_m, map.largest_N(stability::kFullBattery_V));
    for (const files::Json& effect : effects) fmt::print("  {}\n", effect.dump());
    if (effects.empty()) fmt::print("  no effects\n");
  }
  return {{"file", path},
          {"kind", "model"},
          {"vehicle",
           {{"kind", model.kind},
            {"mass_kg", model.mass_kg},
            {"inertia_kg_m2", model.inertia_kg_m2},
            {"arm_m", model.arm_m},
            {"torque_per_thrust_m", model.torque_per_thrust_m},
            {"thrust",
             {{"c00", map.c00}, {"c10", map.c10}, {"c01", map.c01}, {"c20", map.c20}, {"c11", map.c11}}}}},
          {"effects", std::move(effects)}};
}

/// Data for the table of folders and the page, one element per log.
struct Seen {
  std::vector<LogOutcome> outcomes;
  std::vector<InspectedLog> logs;  ///< empty without --report
};

/// A file that may be a log: its contents, or the reason why it cannot be read.
struct LogRead {
  bool is_log = false;  ///< if false, only `error` is set
  logs::Log log;
  files::Json json;  ///< its description in the result
  LogOutcome outcome;
  std::exception_ptr error;
};

LogRead log_read(const std::string& path, const InspectOptions& options) {
  LogRead read;
  try {
    const auto start = std::chrono::steady_clock::now();
    read.is_log = logs::looks_like_log(path);
    if (!read.is_log) return read;
    read.log = options.columns.empty() ? logs::read_log(path)
                                       : logs::read_log(path, logs::read_columns(options.columns));
    read.json = {{"file", path}};
    read.json.update(describe_log(read.log));
    read.outcome = outcome_of(path, read.log, read.json);
    read.outcome.run_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  } catch (const files::InputError&) {
    read.error = std::current_exception();
  }
  return read;
}

/// Returns the logs among `paths` in their order. Reads and holds up to one log per thread ahead.
class LogsInOrder {
 public:
  LogsInOrder(const std::vector<std::string>& paths, const InspectOptions& options, int jobs)
      : paths_(paths), options_(options), jobs_(jobs) {}

  /// Returns the log at paths[index]; each must be requested once and in order.
  LogRead next(std::size_t index) {
    if (index >= first_ + ahead_.size()) {
      first_ = index;
      ahead_.clear();
      ahead_.resize(std::min(paths_.size() - index, static_cast<std::size_t>(files::thread_count(jobs_))));
      files::parallel_for(static_cast<int>(ahead_.size()), jobs_, [&](int i) {
        const auto at = static_cast<std::size_t>(i);
        ahead_[at] = log_read(paths_[index + at], options_);
      });
    }
    return std::move(ahead_[index - first_]);
  }

 private:
  const std::vector<std::string>& paths_;
  const InspectOptions& options_;
  const int jobs_;
  std::size_t first_ = 0;
  std::vector<LogRead> ahead_;
};

files::Json show_log(LogRead read, const InspectOptions& options, const CommonOptions& common, bool in_table,
                     Seen& seen) {
  const std::string path = read.outcome.path;
  if (!options.csv.empty()) {
    std::ostringstream text;
    logs::write_csv(read.log, options.t0_s, options.t1_s, text);
    files::write_file(options.csv, text.str(), common.force);
  }
  seen.outcomes.push_back(std::move(read.outcome));
  if (!options.report.empty())
    seen.logs.push_back({path, read.json, logs::findings(read.log.health), curve_of(read.log)});
  if (common.prints_text()) {
    if (in_table)
      print_log_row(path, read.json);
    else
      print_log(read.log);
  }
  return std::move(read.json);
}

files::Json inspect_other(const std::string& path, const InspectOptions& options,
                          const CommonOptions& common) {
  if (is_model(path)) return inspect_model(path, common.prints_text());
  if (is_json(path)) return inspect_certificate(path, common.prints_text());
  try {
    return inspect_network(path, options.network, common.prints_text());
  } catch (const files::InputError& error) {
    files::InputFault fault = error.fault();
    if (fault.file != path || fault.what.rfind("is neither", 0) != 0) throw;
    fault.what += ", nor a flight log of a known format";
    fault.hint += "; a CSV of a flight ends in .csv";
    throw files::InputError(fault);
  }
}

/// Returns files of one log unchanged, folders as the logs below them, and files of several vehicles as their logs, and
/// reports which logs were taken as one flight and why.
std::vector<std::string> expanded(const std::vector<std::string>& words, bool by_columns,
                                  files::Json& flights, files::Json& skipped) {
  std::vector<std::string> paths;
  for (const std::string& word : words) {
    if (!std::filesystem::is_directory(word) && logs::vehicles_in(word, by_columns).empty()) {
      paths.push_back(word);
      continue;
    }
    const residuals::FoundFlights found = residuals::find_flights({word}, {}, by_columns);
    for (const residuals::FlightFiles& flight : found.flights) {
      files::Json members = files::Json::array();
      for (const auto& [vehicle, path] : flight.logs) {
        paths.push_back(path);
        members.push_back({{"vehicle", vehicle}, {"file", path}});
      }
      flights.push_back({{"name", flight.name}, {"why", flight.why}, {"logs", std::move(members)}});
    }
    for (const std::string& file : found.skipped) skipped.push_back(file);
  }
  return paths;
}

void print_grouping(const files::Json& flights, const files::Json& skipped) {
  if (flights.empty()) return;
  std::map<std::string, std::size_t> reasons;
  for (const files::Json& flight : flights) {
    ++reasons[flight["why"].get<std::string>()];
    if (flight["logs"].size() < 2) continue;
    fmt::print("one flight, {}: {} of {} vehicles\n", flight["why"].get<std::string>(),
               flight["name"].get<std::string>(), flight["logs"].size());
  }
  for (const auto& [why, count] : reasons) fmt::print("{}: {}\n", counted(count, "flight"), why);
  if (reasons["one file"] > 1) {
    fmt::print(
        "(If some of these vehicles flew together, effects of neighbours need their logs as one flight: name "
        "them [<prefix>_]cf<id>_<run>, or group them in a flights.toml.)\n");
  }
  if (!skipped.empty()) fmt::print("Skipped, no flight logs: {}\n", counted(skipped.size(), "file"));
}

/// Where column names alone are not enough, the log is inspected as described by the draft.
void write_draft(InspectOptions& options, const CommonOptions& common) {
  if (options.files.size() != 1) throw UsageError("--columns-draft takes one table");
  refuse_to_replace(common, options.columns_draft);
  files::write_file(options.columns_draft, logs::columns_draft(options.files[0]), common.force);
  if (common.prints_text()) fmt::print("Written: {}\n", options.columns_draft);
  if (!options.columns.empty()) return;
  try {
    logs::read_log(options.files[0]);
  } catch (const files::InputError&) {
    options.columns = options.columns_draft;
  }
}

int run_inspect(InspectOptions options, const CommonOptions& common) {
  if (!options.csv.empty()) {
    if (options.files.size() != 1 || !logs::looks_like_log(options.files[0]))
      throw UsageError("--csv takes one flight log");
    if (!(options.t0_s < options.t1_s)) throw UsageError("--t0 must be before --t1");
    refuse_to_replace(common, options.csv);
  }
  refuse_folder(common, options.report);
  if (!options.columns_draft.empty()) write_draft(options, common);
  files::Json found = files::Json::array(), flights = files::Json::array(), skipped = files::Json::array();
  const std::vector<std::string> paths = expanded(options.files, options.columns.empty(), flights, skipped);
  const bool in_table = paths.size() > options.files.size();
  std::vector<std::string> readable;  ///< files
  std::size_t num_readable = 0;       ///< logs and other files
  Seen seen;
  LogsInOrder in_order(paths, options, common.jobs);
  for (std::size_t i = 0; i < paths.size(); ++i) {
    const std::string& path = paths[i];
    try {
      LogRead log = in_order.next(i);
      if (log.error) std::rethrow_exception(log.error);
      found.push_back(log.is_log ? show_log(std::move(log), options, common, in_table, seen)
                                 : inspect_other(path, options, common));
    } catch (const files::InputError& error) {
      seen.outcomes.push_back({path, false, {}, false, 0, 0, "unreadable: " + error.fault().what});
      note(std::string("swarmcert: ") + error.what());
      found.push_back({{"file", path}, {"kind", "unreadable"}, {"reason", error.what()}});
      continue;
    }
    const std::string file = logs::address_of(path).file;
    if (path == file || readable.empty() || readable.back() != file) readable.push_back(file);
    ++num_readable;
  }
  const std::vector<CollectionRow> rows = collection_rows(options.files, seen.outcomes);
  if (common.prints_text()) {
    print_grouping(flights, skipped);
    print_collections(rows, "in the air");
  }
  files::Json result = result_head("inspect", readable);
  result["files"] = std::move(found);
  if (!flights.empty()) {
    result["flights"] = std::move(flights);
    result["skipped"] = std::move(skipped);
  }
  if (!rows.empty()) result["collections"] = files::to_json(files::record_of(rows));
  if (!options.report.empty()) {
    if (seen.logs.empty()) throw UsageError("--report is a page of flight logs, and none was read");
    const std::string page = write_inspect_report(seen.logs, rows, result, options.report, common.force);
    if (common.prints_text()) fmt::print("Report: {}\n", page);
  }
  write_result(common, result);
  return num_readable == paths.size() ? kDone : kBadInput;
}

}  // namespace

Command inspect_command() {
  return {
      "inspect", "Show and validate weight files, network.toml, models, certificates and flight logs",
      "Exit 0 if every file can be read, else 3 with what is wrong and where. Damage inside a flight log "
      "is skipped,\n"
      "counted and shown.\n\n"
      "Example: swarmcert inspect nn/networks/demo/network.toml\n"
      "         swarmcert inspect cf50_00 --csv cf50_00.csv --t0 2 --t1 12",
      [](CLI::App& app) {
        const auto options = std::make_shared<InspectOptions>();
        app.add_option(
               "FILE", options->files,
               "Weight files, network.toml and model.toml files, certificates, flight logs, folders of logs")
            ->required();
        add_output(app, "--csv", options->csv, "Write the one flight log as CSV in the authors' layout");
        app.add_option("--t0", options->t0_s, "CSV from this time of the log's clock, in seconds");
        app.add_option("--t1", options->t1_s, "CSV to before this time, in seconds");
        app.add_option("--columns", options->columns, "columns.toml: meaning of the columns of CSV logs");
        add_output(
            app, "--report", options->report,
            "Write an HTML page on the flight logs into this folder: phases, events, gaps, signals, what "
            "can be judged, and what to log next time");
        add_output(app, "--columns-draft", options->columns_draft,
                   "Write a columns.toml for the one table (CSV or micro-SD log): meaning, unit and frame of "
                   "its columns, with the "
                   "evidence. Properties not evident from names are guessed from the values and marked; the "
                   "rest is listed to be filled in");
        app.add_option("--key", options->network.key,
                       "Key of the state dict inside a nested checkpoint, e.g. model");
        declare_activation(app, options->network);
        declare_order(app, options->network);
        return [options](const CommonOptions& common) { return run_inspect(*options, common); };
      }};
}

}  // namespace swarmcert::analysis
