#include <fmt/core.h>

#include <memory>
#include <optional>
#include <utility>

#include "analysis/cli/command_line.h"
#include "analysis/cli/host.h"
#include "analysis/cli/progress.h"
#include "analysis/commands/commands.h"
#include "analysis/commands/diagnose/balance_output.h"
#include "analysis/commands/diagnose/diagnose_output.h"
#include "analysis/commands/diagnose/diagnose_report.h"
#include "analysis/commands/diagnose/diagnose_result.h"
#include "analysis/commands/diagnose/each_output.h"
#include "analysis/commands/diagnose/rotor_output.h"
#include "analysis/commands/diagnose/turning_output.h"
#include "analysis/commands/shared/clock_output.h"
#include "analysis/commands/shared/flight_options.h"
#include "analysis/commands/shared/label_output.h"
#include "analysis/commands/shared/plausibility_output.h"
#include "analysis/identification/diagnose.h"
#include "analysis/identification/rotors/lone_rotor.h"

namespace swarmcert::analysis {
namespace {

using identification::Diagnosis;

struct DiagnoseOptions {
  FlightOptions flights;
  std::vector<std::string> against;
  std::string report;
  bool each = false, next = false;
};

/// The results that the options request, for all kinds of vehicles.
struct Answers {
  std::vector<Diagnosis> diagnoses;  ///< one per kind; with --against one per vehicle
  std::vector<identification::Difference> differences;
  std::vector<identification::Each> each;
};

std::vector<std::string> all_next_flights(const std::vector<Diagnosis>& diagnoses) {
  std::vector<std::string> next;
  for (const Diagnosis& diagnosis : diagnoses)
    for (std::string& flight : next_flights(diagnosis, true)) next.push_back(std::move(flight));
  return next;
}

Answers answer(const DiagnoseOptions& options, const CommonOptions& common, const residuals::Inputs& inputs,
               const residuals::Inputs* others) {
  Progress progress(common.quiet);
  const auto show = [&](int done, int total) { progress.show(done, total, "flights"); };
  Answers answers;
  for (const stability::Model& model : inputs.models) {
    const std::size_t first = answers.diagnoses.size();
    if (others == nullptr) {
      answers.diagnoses.push_back(identification::diagnose(
          inputs, model.kind, identification::every_flight(inputs), common.jobs, show));
    } else {
      for (identification::Difference& difference :
           identification::differences(inputs, *others, model.kind, common.jobs, show)) {
        answers.diagnoses.push_back(difference.diagnosis);
        answers.differences.push_back(std::move(difference));
      }
    }
    if (options.each) {
      std::vector<Diagnosis> own(answers.diagnoses.begin() + static_cast<std::ptrdiff_t>(first),
                                 answers.diagnoses.end());
      // With --against the effects common to all flights are unknown, so only the effects of the model are held fixed.
      const auto common_effects =
          others == nullptr ? specs_of(own[0].ranking) : std::vector<stability::EffectSpec>{};
      answers.each.push_back(
          identification::each_flight(inputs, model.kind, common_effects, common.jobs, show));
    }
    // With --against the rotors are compared one by one with those of the healthy flights, see judge_rotors().
    if (others == nullptr)
      identification::name_lone_rotor(inputs, model.kind, identification::every_flight(inputs), common.jobs,
                                      answers.diagnoses[first].ranking);
  }
  return answers;
}

void print(const Answers& answers, const residuals::ForceUnit& unit) {
  for (std::size_t i = 0; i < answers.diagnoses.size(); ++i) {
    print_diagnosis(answers.diagnoses[i], unit);
    if (!answers.differences.empty()) fmt::print("  {}\n", in_words(answers.differences[i]));
  }
  for (const identification::Each& each : answers.each) print_each(each);
}

/// Returns where the model fails, from a pass over the flights of its own.
residuals::FailingPlace where_it_fails(const residuals::Inputs& inputs, const CommonOptions& common,
                                       const residuals::ForceUnit& unit) {
  Progress progress(common.quiet);
  const auto show = [&](int done, int total) { progress.show(done, total, "flights compared"); };
  return residuals::failing_place(residuals::compare(inputs, common.jobs, show), unit);
}

/// The flights of --against, with labels and clocks set right.
residuals::Inputs corrected_others(const DiagnoseOptions& options, const residuals::Inputs& inputs,
                                   const CommonOptions& common) {
  residuals::Inputs others = read_others(options.flights, options.against, inputs);
  identification::find_and_correct_labels(others, common.jobs);
  identification::find_and_correct_clocks(others, common.jobs);
  return others;
}

/// The command to type after a verdict on the flights of one kind.
std::string next_of(identification::Verdict verdict, const FlightOptions& flights,
                    const residuals::Inputs& inputs) {
  const std::string& model = inputs.models[0].path;
  if (verdict == identification::Verdict::kMissingEffect || verdict == identification::Verdict::kUnexplained)
    return next_command("add", {"auto", "--model", model}, flights, inputs, {"-o", "fitted.toml"});
  return next_command("compare", {model}, flights, inputs, {"--json", "errors.json"});
}

std::vector<std::string> notes_of(const std::vector<identification::Mislabelled>& labels,
                                  const std::vector<identification::ClockOffset>& clocks) {
  std::vector<std::string> notes;
  for (const identification::Mislabelled& label : labels) notes.push_back(sentence(label));
  for (const identification::ClockOffset& clock : clocks) notes.push_back(sentence(clock));
  return notes;
}

int run_diagnose(const DiagnoseOptions& options, const CommonOptions& common) {
  refuse_to_replace(common, common.json);
  refuse_folder(common, options.report);
  residuals::Inputs inputs = read_flights(options.flights, false, false, true);
  const std::vector<identification::Mislabelled> labels =
      identification::find_and_correct_labels(inputs, common.jobs);
  const std::vector<identification::ClockOffset> clocks =
      identification::find_and_correct_clocks(inputs, common.jobs);
  const residuals::ForceUnit unit = unit_of(options.flights, inputs);
  std::vector<std::string> files = inputs.files(), other_files;
  std::optional<residuals::Inputs> others;
  if (!options.against.empty()) {
    others = corrected_others(options, inputs, common);
    other_files = add_files_of(*others, files);
  }
  Answers answers = answer(options, common, inputs, others ? &*others : nullptr);
  const bool prints = common.prints_text();
  DiagnoseResult result;
  if (!others) result.fails = where_it_fails(inputs, common, unit);
  if (prints && result.fails) fmt::print("{}\n", sentence(*result.fails));
  if (prints) print(answers, unit);
  result.found = diagnosed(answers.diagnoses);
  Judgement& judgement = result.found.judgement;
  if (others) {
    result.against = Against{other_files, answers.differences};
    result.rotors = judge_rotors(inputs, *others, common.jobs, prints, judgement);
  } else {
    // With --against the rotors are compared one by one with those of the healthy flights.
    result.torques = judge_torques(inputs, common.jobs, prints, judgement);
    result.sensors = judge_accelerometers(inputs, common.jobs, prints, judgement);
    judge_turning(inputs, answers.diagnoses, common.jobs, prints, judgement);
  }
  judgement.append(ranked(clocks));
  judgement.append(ranked(labels));
  judge_motions(inputs, common.jobs, judgement, result.found.problems);
  if (options.each) result.each = answers.each;
  if (options.next) result.next = all_next_flights(answers.diagnoses);
  if (prints) {
    print_clock_offsets(clocks);
    print_mislabelled(labels);
    for (const std::string& flight : result.next.value_or(std::vector<std::string>{}))
      fmt::print("  fly {}\n", flight);
  }
  for (const std::string& problem : few_of_each(result.found.problems)) note("warning: " + problem);
  const files::Node document = result_of("diagnose", files, std::nullopt, result);
  write_result(common, document);
  if (prints) fmt::print("verdict: {}\n", name(judgement.verdict));
  if (prints && !others && inputs.models.size() == 1)
    fmt::print("Next: {}\n", next_of(judgement.verdict, options.flights, inputs));
  if (!options.report.empty()) {
    const std::string path =
        write_diagnose_report(answers.diagnoses, answers.differences, answers.each, notes_of(labels, clocks),
                              unit, to_json(document), options.report, common.force);
    if (prints) fmt::print("Report: {}\n", path);
  }
  if (judgement.verdict != identification::Verdict::kInconclusive) return kDone;
  note("inconclusive: " + judgement.reason);
  return kInconclusive;
}

}  // namespace

Command diagnose_command() {
  return {
      "diagnose", "Find the physical effect that a model lacks, from flights",
      "Every known effect and free curves compete in sets; one counts as found if the best set gains odds "
      "of\n"
      "128 : 1 by it. With set points, what a controller answers to a gust is no evidence. The remainder is\n"
      "analysed separately. Means over a second show a centre of mass off the centre and an "
      "accelerometer\n"
      "that reads too much. Logs with the set points, path, sensors, name or kind of another vehicle are "
      "reported.\n\n"
      "Example: swarmcert diagnose stability/models/crazyflie-small.toml flights/ --report out\n"
      "         swarmcert diagnose model.toml today/ --against monday/ tuesday/ wednesday/",
      [](CLI::App& app) {
        const auto options = std::make_shared<DiagnoseOptions>();
        declare_flights(app, options->flights, true);
        app.add_option(
            "--against", options->against,
            "Other flights (the healthy vehicle, the last release): their effects are held fixed, and the "
            "ranking is the difference of each vehicle beyond their scatter; weakened rotors are reported");
        app.add_flag("--each", options->each,
                     "Also thrust ratio, drag and lag of each flight and day, with drifts and outliers");
        app.add_flag(
            "--next", options->next,
            "Also list flights that would separate rivals, or show effects that these flights cannot");
        add_output(app, "--report", options->report, "Write an HTML report into this folder");
        declare_unit(app, options->flights);
        return [options](const CommonOptions& common) { return run_diagnose(*options, common); };
      },
      fields_of<DiagnoseResult>()};
}

}  // namespace swarmcert::analysis
