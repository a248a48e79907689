#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>

#include "analysis/cli/command_line.h"
#include "analysis/cli/host.h"
#include "analysis/cli/progress.h"
#include "analysis/commands/commands.h"
#include "analysis/commands/diagnose/diagnose_output.h"
#include "analysis/commands/diagnose/diagnose_report.h"
#include "analysis/commands/diagnose/rotor_output.h"
#include "analysis/commands/shared/flight_options.h"
#include "analysis/identification/diagnose.h"
#include "analysis/identification/verdict.h"

namespace swarmcert::analysis {
namespace {

using identification::Diagnosis;

struct DiagnoseOptions {
  FlightOptions flights;
  std::vector<std::string> against;
  std::string report;
};

residuals::Inputs read_others(const DiagnoseOptions& options) {
  FlightOptions others = options.flights;
  others.words.erase(std::remove_if(others.words.begin(), others.words.end(),
                                    [](const std::string& word) {
                                      return std::filesystem::path(word).extension() != ".toml";
                                    }),
                     others.words.end());
  others.words.insert(others.words.end(), options.against.begin(), options.against.end());
  return read_flights(others, false, false, true);
}

/// Flights that are on both sides would be held against themselves.
void refuse_common(const residuals::Inputs& inputs, const residuals::Inputs& others) {
  for (const residuals::FlightFiles& flight : inputs.found.flights) {
    for (const residuals::FlightFiles& other : others.found.flights) {
      if (flight.logs == other.logs)
        throw UsageError("the flight " + flight.name + " is on both sides of --against");
    }
  }
}

int run_diagnose(const DiagnoseOptions& options, const CommonOptions& common) {
  refuse_to_replace(common, common.json);
  refuse_folder(common, options.report);
  const residuals::Inputs inputs = read_flights(options.flights, false, false, true);
  std::vector<std::string> files = inputs.files();
  std::optional<residuals::Inputs> others;
  if (!options.against.empty()) {
    others = read_others(options);
    refuse_common(inputs, *others);
    for (const std::string& file : others->files()) {
      if (std::find(files.begin(), files.end(), file) == files.end()) files.push_back(file);
    }
  }
  files::Json result = result_head("diagnose", files);
  std::vector<Diagnosis> diagnoses;
  for (const stability::Model& model : inputs.models) {
    Progress progress(common.quiet);
    diagnoses.push_back(
        identification::diagnose(inputs, model.kind, identification::every_flight(inputs), common.jobs,
                                 [&](int done, int total) { progress.show(done, total, "flights"); }));
    if (common.prints_text()) print_diagnosis(diagnoses.back());
  }
  add_diagnoses(diagnoses, result);
  const bool names_rotor = others && judge_rotors(inputs, *others, common.jobs, common.prints_text(), result);
  for (const files::Json& problem : result["problems"]) note("warning: " + problem.get<std::string>());
  write_result(common, result);
  std::string reason;
  identification::Verdict verdict = identification::verdict_of(diagnoses, reason);
  if (names_rotor) verdict = identification::Verdict::kMissingEffect;
  if (common.prints_text()) fmt::print("verdict: {}\n", name(verdict));
  if (!options.report.empty()) {
    const std::string path = write_diagnose_report(diagnoses, result, options.report, common.force);
    if (common.prints_text()) fmt::print("Report: {}\n", path);
  }
  if (verdict != identification::Verdict::kInconclusive) return kDone;
  note("inconclusive: " + reason);
  return kInconclusive;
}

}  // namespace

Command diagnose_command() {
  return {"diagnose", "Find the physical effect that a model lacks, from flights",
          "Every known effect is a candidate; one counts as found if it lowers the cross-validated error by "
          "2 %,\n"
          "is significant across blocks of 2 s, and is not contradicted by the set points. The remainder is "
          "analysed separately.\n\n"
          "Example: swarmcert diagnose stability/models/crazyflie-small.toml flights/ --report out",
          [](CLI::App& app) {
            const auto options = std::make_shared<DiagnoseOptions>();
            declare_flights(app, options->flights, true);
            app.add_option("--against", options->against,
                           "Flights of the same vehicles when they were healthy: rotors that give less now "
                           "are named");
            add_output(app, "--report", options->report, "Write an HTML report into this folder");
            return [options](const CommonOptions& common) { return run_diagnose(*options, common); };
          }};
}

}  // namespace swarmcert::analysis
