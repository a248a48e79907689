#include <fmt/core.h>

#include <algorithm>
#include <memory>

#include "analysis/cli/command_line.h"
#include "analysis/cli/host.h"
#include "analysis/cli/progress.h"
#include "analysis/commands/commands.h"
#include "analysis/commands/shared/clock_output.h"
#include "analysis/commands/shared/flight_options.h"
#include "analysis/commands/shared/label_output.h"
#include "analysis/commands/study/study_output.h"
#include "analysis/commands/study/study_report.h"

namespace swarmcert::analysis {
namespace {

struct StudyOptions {
  FlightOptions flights;
  std::vector<std::string> select, test, against;
  std::string output;
};

bool names(const residuals::FoundFlights& found, const residuals::FlightFiles& flight) {
  return std::any_of(found.flights.begin(), found.flights.end(),
                     [&](const residuals::FlightFiles& other) { return other.logs == flight.logs; });
}

/// Flights named by --select and --test; all other flights are used for the fit. Empty if neither option is given.
std::optional<identification::Split> split_of(const StudyOptions& options, const residuals::Inputs& inputs) {
  if (options.select.empty() && options.test.empty()) return std::nullopt;
  if (options.select.empty() || options.test.empty())
    throw UsageError("--select and --test go together: name the flights of both");
  const residuals::FoundFlights select = residuals::find_flights(options.select),
                                test = residuals::find_flights(options.test);
  const auto role = [&](const std::string& file) {
    const auto holds = [&file](const residuals::FoundFlights& found) {
      const std::vector<std::string> logs = log_files(found);
      return std::find(logs.begin(), logs.end(), file) != logs.end();
    };
    return holds(test) ? "--test" : holds(select) ? "--select" : "the fit";
  };
  for (const auto& [copy, first] : inputs.found.copies) {
    const std::string of_copy = role(copy), of_first = role(first);
    if (of_copy != of_first)
      throw UsageError(copy + " (" + of_copy + ") has the bytes of " + first + " (" + of_first +
                       "): it would not be held out");
  }
  identification::Split split;
  for (std::size_t i = 0; i < inputs.found.flights.size(); ++i) {
    const residuals::FlightFiles& flight = inputs.found.flights[i];
    const bool is_select = names(select, flight), is_test = names(test, flight);
    if (is_select && is_test) throw UsageError("--select and --test both name the flight " + flight.name);
    (is_test ? split.test : is_select ? split.select : split.fit).push_back(static_cast<int>(i));
  }
  if (split.fit.empty()) throw UsageError("--select and --test name every flight: none is left for the fit");
  return split;
}

/// Changes relative to the flights of --against, from the flights that are not used for testing only.
Changes changes_against(const residuals::Inputs& others, const std::vector<std::string>& other_files,
                        const identification::Study& study, const residuals::Inputs& inputs, int jobs) {
  residuals::Inputs own = inputs;
  const identification::Split& split = study.ladder.split;
  if (split.by == identification::Split::By::kFlights && !split.fit.empty()) {
    own.found.flights.clear();
    for (std::size_t i = 0; i < inputs.found.flights.size(); ++i) {
      if (std::find(split.test.begin(), split.test.end(), static_cast<int>(i)) == split.test.end())
        own.found.flights.push_back(inputs.found.flights[i]);
    }
  }
  return changes_of(identification::differences(own, others, inputs.models[0].kind, jobs, [](int, int) {}),
                    own, others, other_files, jobs);
}

int run_study(const StudyOptions& options, const CommonOptions& common) {
  refuse_to_replace(common, common.json);
  refuse_folder(common, options.output);
  FlightOptions words = options.flights;
  words.words.insert(words.words.end(), options.select.begin(), options.select.end());
  words.words.insert(words.words.end(), options.test.begin(), options.test.end());
  residuals::Inputs inputs = read_flights(words, false, false, true);
  if (inputs.models.size() != 1)
    throw UsageError("study takes one MODEL; study each kind of vehicle by itself");
  const std::vector<identification::Mislabelled> labels =
      identification::find_and_correct_labels(inputs, common.jobs);
  const std::vector<identification::ClockOffset> clocks =
      identification::find_and_correct_clocks(inputs, common.jobs);
  std::vector<std::string> notes;
  for (const identification::Mislabelled& label : labels) notes.push_back(sentence(label));
  for (const identification::ClockOffset& clock : clocks) notes.push_back(sentence(clock));
  const residuals::ForceUnit unit = unit_of(options.flights, inputs);
  std::vector<std::string> files = inputs.files(), other_files;
  std::optional<residuals::Inputs> others;
  if (!options.against.empty()) {
    others = read_others(words, options.against, inputs);
    identification::find_and_correct_labels(*others, common.jobs);
    identification::find_and_correct_clocks(*others, common.jobs);
    other_files = add_files_of(*others, files);
  }
  Progress progress(common.quiet);
  const identification::Study study = identification::study(
      inputs, split_of(options, inputs), common.jobs,
      [&](int done, int total, const std::string& what) { progress.show(done, total, what); });
  StudyResult result =
      study_result(study, unit, next_of_study(study, options.flights, inputs, options.output));
  result.found.judgement.append(ranked(clocks));
  result.found.judgement.append(ranked(labels));
  if (others) result.changes = changes_against(*others, other_files, study, inputs, common.jobs);
  const files::Node document = result_of("study", files, std::nullopt, result);
  const std::string page = write_study_folder(result, studied(study, inputs, !options.flights.no_embed),
                                              notes, unit, to_json(document), options.output);
  write_result(common, document);
  if (common.prints_text()) {
    print_study(result, unit);
    for (const std::string& note : notes) fmt::print("{}\n", note);
    if (result.changes) print_changes(*result.changes);
    fmt::print("Page: {}\nNext: {}\n", page, result.next_command);
  }
  if (study.ladder.too_poor.empty()) return kDone;
  note("inconclusive: " + study.ladder.too_poor + "; 'swarmcert compare' shows what was cut");
  return kInconclusive;
}

}  // namespace

Command study_command() {
  return {"study", "Find out what a model lacks, add it, and show the error fall, on one page",
          "Compares MODEL with FLIGHTS, finds where it fails and which physical effects are missing, adds "
          "them, and\n"
          "compares again, also on flights not used in the fit. Writes DIR/study.html, "
          "DIR/study.json,\n"
          "DIR/fitted.toml (if an effect was added) and the data of every plot.\n\n"
          "Example: swarmcert study stability/models/crazyflie-small.toml flights/ -o study\n"
          "         swarmcert study model.toml today/ --against monday/ tuesday/ -o study",
          [](CLI::App& app) {
            const auto options = std::make_shared<StudyOptions>();
            declare_flights(app, options->flights, true);
            app.add_option("--select", options->select,
                           "Flights that only decide which effects are accepted");
            app.add_option("--test", options->test, "Test flights, which decide nothing");
            app.add_option("--against", options->against,
                           "Other flights (the healthy vehicle, the last release): the page also shows what "
                           "changed beyond their scatter, like diagnose --against");
            declare_unit(app, options->flights);
            declare_no_embed(app, options->flights);
            add_output(app, "-o,--output", options->output, "Folder for page, result and fitted model")
                ->required();
            return [options](const CommonOptions& common) { return run_study(*options, common); };
          },
          fields_of<StudyResult>()};
}

}  // namespace swarmcert::analysis
