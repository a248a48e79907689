#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <filesystem>
#include <iterator>
#include <limits>
#include <memory>
#include <sstream>
#include <utility>

#include "analysis/cli/command_line.h"
#include "analysis/cli/host.h"
#include "analysis/cli/progress.h"
#include "analysis/commands/commands.h"
#include "analysis/commands/inspect/inspect_certificate.h"
#include "analysis/commands/inspect/inspect_output.h"
#include "analysis/commands/inspect/inspect_report.h"
#include "analysis/commands/shared/collection_table.h"
#include "analysis/logs/columns_draft.h"
#include "analysis/logs/read_log.h"
#include "analysis/logs/vehicles_in_file.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "nn/base/parallel.h"
#include "nn/base/text.h"
#include "nn/base/toml.h"
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

bool is_json(const std::string& path) {
  const std::string text = files::read_file(path);
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  return first != std::string::npos && text[first] == '{';
}

bool is_model(const std::string& path) {
  if (!files::ends_with(path, ".toml")) return false;
  const toml::table document = files::parse_toml(files::read_file(path), path);
  return document["schema"].value_or(std::string()).rfind("swarmcert/model/", 0) == 0;
}

/// A file that may be a log: its contents, or the reason why it cannot be read.
struct LogRead {
  bool is_log = false;  ///< if false, only `error` is set
  LogFile file;
  std::string csv, curve;  ///< if they were asked for
  double run_s = 0;
  std::exception_ptr error;
};

LogRead log_read(const std::string& path, const InspectOptions& options) {
  LogRead read;
  try {
    const auto start = std::chrono::steady_clock::now();
    read.is_log = logs::looks_like_log(path);
    if (!read.is_log) return read;
    logs::Log log = options.columns.empty() ? logs::read_log(path)
                                            : logs::read_log(path, logs::read_columns(options.columns));
    if (!options.csv.empty()) {
      std::ostringstream text;
      logs::write_csv(log, options.t0_s, options.t1_s, text);
      read.csv = text.str();
    }
    if (!options.report.empty()) read.curve = curve_of(log);
    read.file = log_file(path, std::move(log));
    read.run_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
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

LogOutcome outcome_of(const LogFile& file, double run_s) {
  const logs::Signals& signals = file.log.signals;
  LogOutcome outcome;
  outcome.path = file.file;
  outcome.opened = true;
  outcome.seconds = file.story.air_s;
  outcome.run_s = run_s;
  if (!file.story.no_flight.empty()) outcome.left_out_why = "no flight: " + file.story.no_flight;
  for (const logs::Doubt& doubt : file.doubts)
    if (outcome.left_out_why.empty() && doubt.refuses_force)
      outcome.left_out_why = "implausible: " + doubt.signal;
  outcome.torque = signals.torque != logs::TorqueUse::kNone;
  if (outcome.left_out_why.empty() && !signals.force && !outcome.torque)
    outcome.left_out_why = "lacks " + signals.force_lacks;
  for (std::size_t k = 0; k < 3; ++k) outcome.force[k] = signals.force_axes[k];
  if (outcome.left_out_why.empty()) return outcome;
  outcome.torque = false;
  std::fill(std::begin(outcome.force), std::end(outcome.force), false);
  return outcome;
}

InspectedFile other_file(const std::string& path, files::NetworkArguments network) {
  if (is_model(path)) return ModelFile{path, stability::read_model(path)};
  if (is_json(path)) return stated_by_certificate(path);
  try {
    network.file = path;
    return NetworkFile{path, files::load_any_network(network)};
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
                                  residuals::FoundFlights& found) {
  std::vector<std::string> paths;
  for (const std::string& word : words) {
    if (!std::filesystem::is_directory(word) && logs::vehicles_in(word, by_columns).empty()) {
      paths.push_back(word);
      continue;
    }
    const residuals::FoundFlights here = residuals::find_flights({word}, {}, by_columns);
    for (const residuals::FlightFiles& flight : here.flights)
      for (const auto& [vehicle, path] : flight.logs) paths.push_back(path);
    found.flights.insert(found.flights.end(), here.flights.begin(), here.flights.end());
    found.skipped.insert(found.skipped.end(), here.skipped.begin(), here.skipped.end());
  }
  return paths;
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

void print_next_of_logs(const InspectOptions& options, const CommonOptions& common) {
  std::vector<std::string> next = {"model", "draft"};
  next.insert(next.end(), options.files.begin(), options.files.end());
  if (!options.columns.empty()) next.insert(next.end(), {"--columns", options.columns});
  next.insert(next.end(), {"-o", "model.toml"});
  if (common.prints_text()) fmt::print("With a model of the vehicle, 'swarmcert study' says what it lacks. ");
  print_next(common, next);
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
  InspectResult result;
  const std::vector<std::string> paths = expanded(options.files, options.columns.empty(), result.found);
  const bool in_table = paths.size() > options.files.size();
  std::vector<std::string> readable;  ///< files
  std::size_t num_readable = 0;       ///< logs and other files
  std::vector<LogOutcome> outcomes;
  std::vector<std::string> curves;  ///< of logs
  LogsInOrder in_order(paths, options, common.jobs);
  Progress progress(common.quiet);
  for (std::size_t i = 0; i < paths.size(); ++i) {
    const std::string& path = paths[i];
    try {
      LogRead log = in_order.next(i);
      if (log.error) std::rethrow_exception(log.error);
      if (log.is_log) {
        if (!options.csv.empty()) files::write_file(options.csv, log.csv, common.force);
        outcomes.push_back(outcome_of(log.file, log.run_s));
        curves.push_back(std::move(log.curve));
      }
      result.files.push_back(log.is_log ? std::move(log.file) : other_file(path, options.network));
    } catch (const files::InputError& error) {
      outcomes.push_back({path, false, {}, false, 0, 0, "unreadable: " + error.fault().what});
      note(std::string("swarmcert: ") + error.what());
      result.files.push_back(UnreadableFile{path, error.what()});
      continue;
    }
    const bool is_row = in_table && std::holds_alternative<LogFile>(result.files.back());
    if (common.prints_text() && !is_row) print_file(result.files.back());
    progress.show(static_cast<int>(i + 1), static_cast<int>(paths.size()), "files read");
    const std::string file = logs::address_of(path).file;
    if (path == file || readable.empty() || readable.back() != file) readable.push_back(file);
    ++num_readable;
  }
  result.collections = collection_rows(options.files, outcomes);
  if (common.prints_text()) {
    if (in_table) fmt::print("{}", to_text(log_list(logs_of(result))));
    print_grouping(result.found);
    print_collections(result.collections, "in the air");
  }
  const files::Node described = result_of("inspect", readable, std::nullopt, result);
  if (!options.report.empty()) {
    if (curves.empty()) throw UsageError("--report is a page of flight logs, and none was read");
    const std::string page = write_inspect_report(result, curves, described, options.report, common.force);
    if (common.prints_text()) fmt::print("Report: {}\n", page);
  }
  write_result(common, described);
  const std::vector<const LogFile*> inspected = logs_of(result);
  const bool any_flew = std::any_of(inspected.begin(), inspected.end(),
                                    [](const LogFile* log) { return log->story.no_flight.empty(); });
  if (any_flew && outcomes.size() == num_readable) print_next_of_logs(options, common);
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
      },
      fields_of<InspectResult>()};
}

}  // namespace swarmcert::analysis
