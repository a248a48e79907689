#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <functional>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <set>

#include "analysis/cli/command_line.h"
#include "analysis/cli/counted.h"
#include "analysis/cli/host.h"
#include "analysis/cli/progress.h"
#include "analysis/commands/commands.h"
#include "analysis/commands/compare/budget_output.h"
#include "analysis/commands/compare/compare_output.h"
#include "analysis/commands/compare/compare_report.h"
#include "analysis/commands/compare/compare_result.h"
#include "analysis/commands/shared/flight_options.h"
#include "analysis/commands/shared/prediction_output.h"
#include "analysis/residuals/comparison.h"
#include "analysis/residuals/flight_errors.h"
#include "analysis/residuals/flight_peaks.h"
#include "analysis/residuals/injected_log.h"
#include "analysis/residuals/log_copies.h"
#include "analysis/residuals/prediction.h"
#include "analysis/tracking/kept_promise.h"
#include "nn/base/file_io.h"
#include "nn/base/suggest.h"
#include "stability/bounds/tracking_bounds.h"

namespace swarmcert::analysis {
namespace {

struct CompareOptions {
  FlightOptions flights;
  std::string report;
  std::vector<std::string> gains;
  std::vector<std::string> budget;
  std::string fitted;
  std::string inject;
  std::string promise;
  double horizon_s = 0;
  std::string predictions;
};

/// Parses "FILE" for every kind, or "KIND=FILE" for one kind.
residuals::GainsOfKinds read_gains(const std::vector<std::string>& words) {
  residuals::GainsOfKinds gains;
  for (const std::string& word : words) {
    const std::size_t equals = word.find('=');
    const std::string kind = equals == std::string::npos ? "" : word.substr(0, equals);
    const std::string path = equals == std::string::npos ? word : word.substr(equals + 1);
    if (!gains.emplace(kind, stability::load_gains(path)).second)
      throw UsageError("--gains names " + (kind.empty() ? "every kind" : "the kind " + kind) + " twice");
  }
  return gains;
}

/// @throws UsageError if gains are given for a kind that no compared vehicle has.
void check_kinds(const residuals::GainsOfKinds& gains, const residuals::Inputs& inputs) {
  std::vector<std::string> kinds;
  for (const stability::Model& model : inputs.models) kinds.push_back(model.kind);
  for (const auto& [kind, file] : gains) {
    if (kind.empty() || std::find(kinds.begin(), kinds.end(), kind) != kinds.end()) continue;
    throw UsageError("--gains is for kind " + kind +
                     ", which no vehicle has: " + files::did_you_mean(kind, kinds));
  }
}

/// The fit uses the models and rules of the comparison, but other flights.
identification::Budget budget_of(const CompareOptions& options, const residuals::Inputs& inputs,
                                 const CommonOptions& common) {
  FlightOptions words = options.flights;
  words.words.clear();
  words.network.clear();
  for (const std::string& word : options.flights.words) {
    if (std::filesystem::path(word).extension() == ".toml") words.words.push_back(word);
  }
  words.words.insert(words.words.end(), options.budget.begin(), options.budget.end());
  residuals::Inputs fit = read_flights(words, true, false, true);
  residuals::LogCopies copies;
  for (const std::string& log : log_files(inputs.found)) copies.add(log);
  for (const std::string& log : log_files(fit.found)) {
    const std::string judged = copies.add(log);
    if (!judged.empty())
      throw UsageError("--budget names a flight that is also judged: " + log + " is " + judged);
  }
  Progress progress(common.quiet);
  return identification::error_budget(fit, inputs, options.flights.network, common.jobs,
                                      [&](int done, int total) { progress.show(done, total, "passes"); });
}

/// Writes every log with the contribution of the model's effects added to its accelerometer; logs of vehicles without
/// a model are copied unchanged. Folder and file names are kept, so that flights remain flights.
InjectedLogs inject(const residuals::Inputs& inputs, const std::string& folder, bool overwrite) {
  namespace fs = std::filesystem;
  InjectedLogs result;
  const auto place_of = [](const std::string& log) {
    const fs::path from = fs::absolute(log).lexically_normal();
    return (from.parent_path().filename() / from.filename()).string();
  };
  std::map<std::string, std::string> places;
  for (const residuals::FlightFiles& flight : inputs.found.flights) {
    for (const auto& [vehicle, log] : flight.logs) {
      const auto [other, is_new] = places.emplace(fs::path(place_of(log)).replace_extension().string(), log);
      if (!is_new)
        throw UsageError("--inject would write " + other->second + " and " + log +
                         " to the same place: inject them one after the other, into folders of their own");
    }
  }
  for (std::size_t i = 0; i < inputs.found.flights.size(); ++i) {
    std::vector<std::string> problems;
    for (const residuals::Track& track : inputs.load(i, problems)) {
      const std::string place = place_of(track.path);
      fs::path to = fs::path(folder) / place;
      if (!track.position_only) to.replace_extension();
      fs::create_directories(to.parent_path());
      files::write_file(to.string(),
                        track.position_only ? files::read_file(track.path)
                                            : stability::to_usd_log(residuals::injected_log(inputs, track)),
                        overwrite);
      (track.position_only ? result.unchanged : result.logs).push_back(place);
    }
  }
  return result;
}

ErrorsOfFlights errors_of(const std::vector<std::vector<residuals::FlightError>>& by_flight) {
  std::vector<residuals::FlightError> all;
  for (const auto& errors : by_flight) all.insert(all.end(), errors.begin(), errors.end());
  ErrorsOfFlights result;
  result.velocity = residuals::velocity_error(all);
  for (residuals::FlightError& error : all) result.by_log.emplace(error.path, std::move(error));
  return result;
}

void print_promise_kept(const JudgedPromise& judged) {
  fmt::print("\nThe promise of {} (probability {:g}) on flights that it was not made from\n", judged.file,
             judged.promise.level);
  for (int axis = 0; axis < 3; ++axis) {
    const KeptAlong& along = judged.kept.axes[static_cast<std::size_t>(axis)];
    const char* const name = stability::axis_name(axis);
    if (along.flights == 0) {
      fmt::print("  {}: no flight has a set point\n", name);
      continue;
    }
    fmt::print("  {}: held in {} of {} flights ({:.3g}, 90 % interval {:.3f} to {:.3f})\n", name, along.held,
               along.flights, along.share(), along.interval_90.lower, along.interval_90.upper);
  }
  if (!judged.kept.used.empty())
    fmt::print("  left out: {} logs that it was made from, and all of their flights\n",
               judged.kept.used.size());
}

/// Predicts over --horizon, and writes the predictions where --predictions says.
std::optional<Prediction> predict(const CompareOptions& options, const residuals::Inputs& inputs,
                                  const CommonOptions& common) {
  const bool keeps = !options.predictions.empty();
  std::vector<residuals::FlightPrediction> flights =
      residuals::predict(inputs, options.horizon_s, keeps, common.jobs);
  if (keeps) write_predictions(flights, options.predictions, common.force);
  for (residuals::FlightPrediction& flight : flights) flight.states = {};
  return prediction_of(std::move(flights));
}

/// Output files must not exist yet, unless --force is given.
void check_outputs(const CompareOptions& options, const CommonOptions& common) {
  refuse_to_replace(common, common.json);
  refuse_folder(common, options.report);
  if (!options.inject.empty() &&
      !(std::filesystem::is_directory(options.inject) && std::filesystem::is_empty(options.inject)))
    refuse_to_replace(common, options.inject);
  if (!options.predictions.empty()) {
    if (options.horizon_s == 0) throw UsageError("--predictions writes what --horizon predicts: give it");
    refuse_folder(common, options.predictions);
  }
  if (!options.fitted.empty()) {
    if (options.budget.empty()) throw UsageError("--fitted writes what --budget fits: name its flights");
    refuse_to_replace(common, (std::filesystem::path(options.fitted) / "flights.toml").string());
  }
}

/// Computes what was requested in addition to the comparison.
void add_extras(const CompareOptions& options, const CommonOptions& common, const residuals::Progress& show,
                CompareResult& result) {
  const residuals::Inputs& inputs = result.inputs;
  if (options.flights.published_filter) {
    FlightOptions without = options.flights;
    without.published_filter = false;
    result.own = residuals::compare(read_flights(without, true), common.jobs, show);
  }
  if (!options.budget.empty()) {
    result.budget = budget_of(options, inputs, common);
    if (!options.fitted.empty()) write_fitted(*result.budget, inputs.fleet, options.fitted, common.force);
  }
  if (!options.inject.empty()) result.injected = inject(inputs, options.inject, common.force);
  if (!options.promise.empty()) {
    const Promise promise = read_promise(options.promise);
    result.promise = {options.promise, promise,
                      kept_promise(promise, residuals::flight_peaks(inputs, common.jobs))};
  }
  if (options.horizon_s > 0) result.prediction = predict(options, inputs, common);
}

/// If no log could be read, the input is bad; if the flights contain too little data, the result is inconclusive.
int exit_code_of(const residuals::Comparison& comparison) {
  const bool has_torque = std::any_of(comparison.tracks.begin(), comparison.tracks.end(),
                                      [](const residuals::TrackErrors& track) {
                                        return track.torque.records + track.torque.slow_records > 0;
                                      });
  if (comparison.overall.statistics.samples > 0 || has_torque) return kDone;
  note("no usable record: nothing was compared" + (comparison.problems.empty()
                                                       ? "; 'swarmcert inspect LOG' shows what is in a log"
                                                       : ": " + comparison.problems[0]));
  const bool refused = std::any_of(comparison.tracks.begin(), comparison.tracks.end(), [](const auto& track) {
    return std::any_of(track.doubts.begin(), track.doubts.end(),
                       [](const auto& d) { return d.refuses_force; });
  });
  return refused || comparison.tracks.empty() ? kBadInput : kInconclusive;
}

int run_compare(const CompareOptions& options, const CommonOptions& common) {
  const auto start = std::chrono::steady_clock::now();
  check_outputs(options, common);
  const residuals::GainsOfKinds gains = read_gains(options.gains);
  CompareResult result;
  residuals::Inputs& inputs = result.inputs;
  inputs = read_flights(options.flights, true, true);
  // A single pass reads each log once, or twice in succession, so a small cache suffices.
  constexpr std::size_t kOfOnePass_bytes = std::size_t{64} << 20;
  if (options.budget.empty() && options.inject.empty() && options.promise.empty())
    inputs.cache = std::make_shared<residuals::LogCache>(inputs.rules.per_mass, kOfOnePass_bytes);
  const residuals::ForceUnit unit = result.unit = unit_of(options.flights, inputs);
  check_kinds(gains, inputs);
  Progress progress(common.quiet);
  const auto show = [&](int done, int total) { progress.show(done, total, "flights"); };
  // Only these outputs use the errors of single flights, which take as long as the comparison.
  const bool wants_errors = !common.json.empty() || !options.report.empty() || host() != nullptr;
  std::vector<std::vector<residuals::FlightError>> errors(inputs.found.flights.size());
  const auto add_error = [&](std::size_t flight, const residuals::Track& track) {
    if (!wants_errors) return;
    if (auto error = residuals::flight_error(inputs, track)) errors[flight].push_back(std::move(*error));
  };
  result.comparison = residuals::compare(inputs, common.jobs, show, gains, add_error);
  std::vector<std::string> files = inputs.files();
  for (const auto& [kind, file] : gains) files.push_back(file.path);
  if (!options.promise.empty()) files.push_back(options.promise);
  if (wants_errors) result.errors = errors_of(errors);
  add_extras(options, common, show, result);
  const files::Node described = result_of("compare", files, std::nullopt, result);
  write_result(common, described);
  if (common.prints_text()) {
    print_comparison(result.comparison, inputs, result.own ? &*result.own : nullptr, unit);
    if (result.promise) print_promise_kept(*result.promise);
    if (result.budget) print(*result.budget, unit);
    if (result.prediction) print_prediction(*result.prediction);
    const std::chrono::duration<double> run = std::chrono::steady_clock::now() - start;
    if (inputs.found.flights.size() > 1)
      fmt::print("Run time: {:.1f} s for {}.\n", run.count(), counted(inputs.found.flights.size(), "flight"));
    const bool has_force = result.comparison.overall.statistics.samples > 0;
    if (has_force && inputs.models.size() == 1 && !inputs.rules.per_mass)
      fmt::print("Next: {}\n",
                 next_command("diagnose", {inputs.models[0].path}, options.flights, inputs, {}));
  }
  if (!options.report.empty()) {
    const std::vector<residuals::FlownFlight> flights =
        options.flights.no_embed ? std::vector<residuals::FlownFlight>()
                                 : residuals::flown_signals(inputs, nullptr, result.comparison.moments);
    const std::string path =
        write_compare_report(result, flights, unit, described, options.report, common.force);
    if (common.prints_text()) fmt::print("Report: {}\n", path);
  }
  return exit_code_of(result.comparison);
}

}  // namespace

Command compare_command() {
  return {
      "compare", "Compare a model with flights: force residuals, and where the model fails",
      "Records on the ground, after a crash, with rotors off, after gaps and without a known neighbour are "
      "cut;\n"
      "the result counts them. Forces are in newton in the JSON, and in one unit in text and pages.\n\n"
      "Example: swarmcert compare stability/models/crazyflie-small.toml flights/ --report out\n"
      "         swarmcert compare flights/ --network network.toml --published-filter\n"
      "         swarmcert compare test/ --budget development/ --network network.toml\n"
      "         swarmcert compare truth.toml flights/ --inject injected\n"
      "         swarmcert compare model.toml flights/ --horizon 0.5 --predictions predicted\n"
      "         swarmcert compare flights/ --gains small=small.toml --gains large=large.toml",
      [](CLI::App& app) {
        const auto options = std::make_shared<CompareOptions>();
        declare_flights(app, options->flights, true);
        add_output(app, "--report", options->report, "Write an HTML report into this folder");
        declare_unit(app, options->flights);
        declare_no_embed(app, options->flights);
        app.add_option(
            "--gains", options->gains,
            "gains.toml, or KIND=gains.toml for each kind: also simulates the closed loop from the "
            "logs' set points");
        app.add_option("--network", options->flights.network,
                       "network.toml: a learned force for every model, in place of its own");
        app.add_option(
            "--budget", options->budget,
            "Flights to fit: how the error of FLIGHTS falls from the nominal model by motor lag, offset "
            "per vehicle, ground, downwash and the rest; --network adds a row");
        add_output(app, "--fitted", options->fitted,
                   "Folder for the models fitted by --budget, one per vehicle, and their flights.toml");
        app.add_option(
            "--promise", options->promise,
            "Result of bound --coverage: how often its promise holds on the FLIGHTS not used to make it");
        app.add_option(
               "--horizon", options->horizon_s,
               "Predict this many seconds from every measured state with the logged motor commands or "
               "rotor speeds: error of position, velocity, rotation and rate against the horizon")
            ->check(CLI::Range(0.001, 60.0));
        add_output(app, "--predictions", options->predictions,
                   "Folder for what --horizon predicts: FLIGHT.npy, float32, [starts x steps x 13]");
        add_output(app, "--inject", options->inject,
                   "Write FLIGHTS into this folder with the force of the model's effects added to the "
                   "accelerometer (open loop: nothing else changes)");
        app.add_flag(
            "--published-filter", options->flights.published_filter,
            "Cut and filter as the networks' authors did: 32 g (small) and 67 g (large), thrust lag 0.16 "
            "per record, clocks as they are, |f_a,z| < 50 gf, contact kept; also prints the mean squares "
            "with this project's own filter");
        return [options](const CommonOptions& common) { return run_compare(*options, common); };
      },
      fields_of<CompareResult>()};
}

}  // namespace swarmcert::analysis
