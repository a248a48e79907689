#include "analysis/commands/study/study_report.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <set>

#include "analysis/cli/command_line.h"
#include "analysis/commands/add/add_report.h"
#include "analysis/commands/diagnose/diagnose_output.h"
#include "analysis/commands/diagnose/diagnose_report.h"
#include "analysis/commands/diagnose/remainder_output.h"
#include "analysis/commands/shared/effect_output.h"
#include "analysis/commands/shared/time_plots.h"
#include "analysis/commands/study/study_output.h"
#include "analysis/report/report.h"
#include "analysis/report/report_text.h"
#include "nn/base/file_io.h"

namespace swarmcert::analysis {
namespace {

using identification::Study;

void add_findings(Report& report, const Study& study) {
  std::vector<std::vector<std::string>> rows;
  for (const stability::EffectSpec& effect : study.ladder.model.effects) {
    for (const auto& [parameter, value] : effect.parameters) {
      const std::string interval = interval_words(effect.name, parameter, effect.fit.interval);
      rows.push_back({effect.name, parameter,
                      fmt::format("{:.4g}", shown_beyond_file(effect.name, parameter) + value),
                      interval.empty() ? "-" : interval});
    }
  }
  if (!rows.empty()) report.table({"effect", "parameter", "value", "90 % interval"}, rows);
  rows.clear();
  for (const identification::Missing& missing : study.diagnosis.ranking) {
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

void add_moments(Report& report, const Study& study, const residuals::ForceUnit& unit) {
  std::vector<ShownMoment> shown;
  for (const residuals::Moment& moment : study.before.all.moments) {
    for (const residuals::TrackErrors& track : study.before.all.tracks) {
      if (track.path != moment.path) continue;
      shown.push_back({series_name(track), moment.time_s, track.flight, moment.time_s - track.clock_offset_s,
                       fmt::format("{:.3g} {}", moment.residual_N.norm() * unit.per_newton(), unit.name)});
    }
  }
  if (shown.empty()) return;
  report.paragraph("The worst moments of the given model, means over 0.1 s:");
  report.moments(shown);
}

std::size_t count_flights(const residuals::Comparison& comparison) {
  std::set<std::string> flights;
  for (const residuals::TrackErrors& track : comparison.tracks) flights.insert(track.flight);
  return flights.size();
}

void add_replay(Report& report, const Study& study, const residuals::ForceUnit& unit) {
  std::vector<Replay> flights;
  for (const identification::ReplayFlight& flight : study.replay) {
    Replay replay{flight.name, {}};
    for (const identification::ReplayVehicle& vehicle : flight.vehicles) {
      replay.vehicles.push_back({vehicle.name, vehicle.rows});
      for (std::array<float, 10>& row : replay.vehicles.back().rows)
        for (std::size_t k = 4; k < row.size(); ++k) row[k] *= static_cast<float>(unit.per_newton());
    }
    flights.push_back(std::move(replay));
  }
  if (flights.empty()) return;
  report.heading("In space");
  report.replay(flights, unit.name,
                fmt::format("{} of {} flights, those with the worst moments first. Arrows are the residual "
                            "force on each vehicle under the given and under the fitted model; trails are "
                            "4 s long. Drag, or use the arrow keys, to turn; + and - zoom.",
                            flights.size(), count_flights(study.before.all)));
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

using Notes = std::vector<std::string>;

std::string write_page(const StudyResult& result, const Notes& notes, const residuals::ForceUnit& unit,
                       const files::Json& document, const std::string& folder) {
  const Study& study = result.study;
  Report report("What does the model lack?");
  report.made_by(command_to_copy());
  report.result(document);
  report.paragraph(headline(result, unit));
  for (const std::string& line : conclusions(result, unit)) report.paragraph(line);
  for (const std::string& note : notes) report.paragraph(note);
  report.paragraph("Next: " + result.next_command);
  report.heading("Where the model failed");
  add_before_and_after(report, study.before.all, study.after.all, study.pictures.room, unit);
  add_moments(report, study, unit);
  report.heading("What was missing");
  if (study.pictures.effects.empty()) report.paragraph("No effect was added.");
  add_effect_curves(report, study.pictures.effects, unit);
  add_findings(report, study);
  report.heading("How the error fell");
  add_ladder_figure(report, study.ladder.rows, "ladder", unit);
  report.heading("The remainder, and what to fly next");
  add_left(report, study.diagnosis, unit);
  add_remainder(report, study.diagnosis, 1, unit);
  if (result.next.empty())
    report.paragraph("Another flight would not answer any of the questions that are still open.");
  for (const std::string& flight : result.next) report.paragraph("Fly " + flight + ".");
  if (result.changes) add_changes(report, *result.changes, unit);
  add_time_series(report, study.after.all, &study.before.all, unit.name, unit.per_newton());
  add_replay(report, study, unit);
  return report.write(folder, true, "study.html");
}

}  // namespace

std::string write_study_folder(const StudyResult& result, const Notes& notes,
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
  return write_page(result, notes, unit, document, folder);
}

}  // namespace swarmcert::analysis
