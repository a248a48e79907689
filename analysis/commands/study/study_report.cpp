#include "analysis/commands/study/study_report.h"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>

#include "analysis/cli/command_line.h"
#include "analysis/commands/add/add_report.h"
#include "analysis/commands/diagnose/diagnose_output.h"
#include "analysis/commands/diagnose/diagnose_report.h"
#include "analysis/commands/diagnose/remainder_output.h"
#include "analysis/commands/shared/effect_output.h"
#include "analysis/commands/shared/report_head.h"
#include "analysis/commands/shared/time_plots.h"
#include "analysis/commands/study/study_output.h"
#include "analysis/report/report.h"
#include "nn/base/file_io.h"

namespace swarmcert::analysis {
namespace {

using identification::Study;

void add_findings(Report& report, const StudyResult& result) {
  std::vector<std::vector<std::string>> rows;
  for (const Cause& cause : result.causes) {
    for (const auto& [parameter, value] : cause.parameters) {
      const auto& interval = value.interval_90;
      if (!cause.measure && !(interval && interval->lower < interval->upper)) continue;  // it was held
      rows.push_back({cause.name, parameter, fmt::format("{:.4g}", value.value),
                      interval ? fmt::format("{:.4g} .. {:.4g}", interval->lower, interval->upper) : "-"});
    }
  }
  if (!rows.empty()) report.table({"effect", "parameter", "value", "90 % interval"}, rows);
  rows.clear();
  for (const identification::Missing& missing : result.study.diagnosis.ranking) {
    std::string rivals;
    for (const identification::Rival& rival : missing.finding.rivals)
      rivals += (rivals.empty() ? "" : ", ") + rival.effect;
    if (!rivals.empty() || missing.equivalence_class != missing.effect)
      rows.push_back({missing.effect, missing.equivalence_class, rivals, missing.excitation});
  }
  if (!rows.empty())
    report.table(
        {"effect", "cannot be told apart in flight", "rivals on these flights", "flights that separate"},
        rows);
}

void add_changes(Report& report, const Changes& changes, const residuals::ForceUnit& unit) {
  report.heading("What changed against the other flights");
  for (const std::string& sentence : in_words(changes)) report.paragraph(sentence + ".");
  std::size_t number = 0;
  for (const identification::Difference& difference : changes.against.differences) {
    report.paragraph(difference.vehicle + ". " + in_words(difference));
    ++number;
    if (!difference.diagnosis.ranking.empty())
      add_ranking(report, difference.diagnosis, fmt::format("changed_{}", number), unit);
  }
}

/// Whether the given model has the effect already: it was not missing.
bool has_effect(const stability::Model& model, const std::string& name) {
  return std::any_of(model.effects.begin(), model.effects.end(),
                     [&](const stability::EffectSpec& effect) { return effect.name == name; });
}

using Notes = std::vector<std::string>;

/// Lines that begin with a space are equations.
void add_answer(Report& report, const StudyResult& result, const Notes& notes,
                const residuals::ForceUnit& unit) {
  report.paragraph(headline(result, unit));
  for (const std::string& line : conclusions(result, unit)) {
    if (line[0] == ' ')
      report.literal(line.substr(line.find_first_not_of(' ')));
    else
      report.paragraph(line);
  }
  for (const std::string& note : notes) report.paragraph(note);
  report.paragraph("Next:");
  report.literal(result.next_command);
}

std::string write_page(const StudyResult& result, const StudyFlights& flights, const Notes& notes,
                       const residuals::ForceUnit& unit, const files::Json& document,
                       const std::string& folder) {
  const Study& study = result.study;
  Report report("What does the model lack?");
  report.made_by(command_to_copy());
  report.result(document);
  add_report_head(report, flights.inputs, study.before.all, &study.ladder);
  add_answer(report, result, notes, unit);
  report.heading("What was missing");
  if (result.causes.empty()) report.paragraph("No effect was added.");
  std::vector<identification::EffectCurve> added;
  for (const identification::EffectCurve& curve : study.pictures.effects)
    if (!has_effect(flights.inputs.models[0], curve.effect)) added.push_back(curve);
  add_effect_curves(report, added, unit);
  add_findings(report, result);
  report.heading("How the error fell");
  add_ladder_figure(report, study.ladder.rows, "ladder", unit);
  add_prediction(report, {{"before", result.predicted_before}, {"after", result.predicted_after}});
  report.heading("Where the model failed");
  add_before_and_after(report, study.before.all, study.after.all, study.pictures.room, unit);
  add_moments(report, study.before.all, unit);
  add_flown(report, flights.flown, study.before.all, unit);
  report.heading("What is left, and what to fly next");
  if (adds_forms(result)) {
    report.paragraph("With all that was added: " + residuals::sentence(result.left));
    add_detectable(report, study.diagnosis);
  } else {
    add_left(report, study.diagnosis, unit);
    add_remainder(report, study.diagnosis, 1, unit);
  }
  if (result.next.empty())
    report.paragraph("Another flight would not answer any of the questions that are still open.");
  for (const std::string& flight : result.next) report.paragraph("Fly " + flight + ".");
  if (result.changes) add_changes(report, *result.changes, unit);
  return report.write(folder, true, "study.html");
}

}  // namespace

StudyFlights studied(const Study& study, const residuals::Inputs& inputs, bool embeds) {
  if (!embeds) return {inputs, {}};
  residuals::Inputs fitted = inputs;
  if (study.ladder.any_accepted) fitted.models[0] = study.ladder.model;
  return {inputs, residuals::flown_signals(inputs, &fitted, study.before.all.moments)};
}

std::string write_study_folder(const StudyResult& result, const StudyFlights& flights, const Notes& notes,
                               const residuals::ForceUnit& unit, const files::Json& document,
                               const std::string& folder) {
  const std::filesystem::path path(folder);
  std::filesystem::create_directories(path);
  const identification::Ladder& ladder = result.study.ladder;
  if (ladder.any_accepted) {
    files::write_file((path / "fitted.toml").string(),
                      stability::to_toml(ladder.model, {"Effects fitted to flights by swarmcert study."}),
                      true);
  }
  files::write_file((path / "study.json").string(), files::to_text(document), true);
  return write_page(result, flights, notes, unit, document, folder);
}

}  // namespace swarmcert::analysis
