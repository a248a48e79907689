#include <fmt/core.h>

#include <memory>

#include "analysis/cli/command_line.h"
#include "analysis/cli/host.h"
#include "analysis/cli/progress.h"
#include "analysis/commands/commands.h"
#include "analysis/commands/diagnose/diagnose_output.h"
#include "analysis/commands/diagnose/diagnose_report.h"
#include "analysis/commands/shared/flight_options.h"
#include "analysis/identification/diagnose.h"
#include "analysis/identification/verdict.h"

namespace swarmcert::analysis {
namespace {

using identification::Diagnosis;

struct DiagnoseOptions {
  FlightOptions flights;
  std::string report;
};

int run_diagnose(const DiagnoseOptions& options, const CommonOptions& common) {
  refuse_to_replace(common, common.json);
  refuse_folder(common, options.report);
  const residuals::Inputs inputs = read_flights(options.flights, false, false, true);
  files::Json result = result_head("diagnose", inputs.files());
  std::vector<Diagnosis> diagnoses;
  for (const stability::Model& model : inputs.models) {
    Progress progress(common.quiet);
    diagnoses.push_back(
        identification::diagnose(inputs, model.kind, identification::every_flight(inputs), common.jobs,
                                 [&](int done, int total) { progress.show(done, total, "flights"); }));
    if (common.prints_text()) print_diagnosis(diagnoses.back());
  }
  add_diagnoses(diagnoses, result);
  for (const files::Json& problem : result["problems"]) note("warning: " + problem.get<std::string>());
  write_result(common, result);
  std::string reason;
  const identification::Verdict verdict = identification::verdict_of(diagnoses, reason);
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
            add_output(app, "--report", options->report, "Write an HTML report into this folder");
            return [options](const CommonOptions& common) { return run_diagnose(*options, common); };
          }};
}

}  // namespace swarmcert::analysis
