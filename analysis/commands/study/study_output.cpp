#include "analysis/commands/study/study_output.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "analysis/commands/add/add_output.h"
#include "analysis/commands/diagnose/diagnose_output.h"
#include "analysis/commands/diagnose/rotor_output.h"
#include "analysis/commands/shared/flight_options.h"
#include "analysis/identification/verdict.h"

namespace swarmcert::analysis {
namespace {

using identification::Study;
using identification::StudyErrors;

files::Json group_json(const residuals::GroupErrors& errors) {
  const residuals::ErrorStatistics& s = errors.statistics;
  return {{"records", s.samples},
          {"rmse", json_of(s.rmse)},
          {"bias", json_of(s.bias)},
          {"p95", json_of(s.p95)},
          {"max", json_of(s.max)}};
}

files::Json json_of(const StudyErrors& errors) {
  return {{"all", group_json(errors.all.overall)}, {"test", group_json(errors.test.overall)}};
}

std::vector<std::string> accepted_effects(const Study& study) {
  std::vector<std::string> names;
  for (const stability::LadderRow& row : study.ladder.rows)
    if (row.accepted && row.effect != "nominal") names.push_back(row.effect);
  return names;
}

/// Joins words as "a", "a and b", "a, b and c".
std::string listed(const std::vector<std::string>& words) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i)
    text += (i == 0 ? "" : i + 1 == words.size() ? " and " : ", ") + words[i];
  return text;
}

/// The reason stated by the comparison for the flights, or else for their records.
std::string why_nothing_is_judged(const Study& study) {
  const residuals::Comparison& comparison = study.before.all;
  if (!comparison.problems.empty()) return comparison.problems[0];
  for (const residuals::TrackErrors& track : comparison.tracks)
    for (const logs::Doubt& doubt : track.doubts)
      if (doubt.refuses_force) return doubt.words;
  return "every record was cut, see 'swarmcert compare' and 'swarmcert inspect'";
}

double vertical_N(const residuals::Comparison& comparison) { return comparison.overall.statistics.rmse.z; }

}  // namespace

std::string headline(const Study& study, const residuals::ForceUnit& unit) {
  const auto shown = [&unit](double newton) { return fmt::format("{:.3g}", newton * unit.per_newton()); };
  const std::vector<std::string> added = accepted_effects(study);
  const std::string left =
      leaves_something(study.diagnosis) ? "part of the error remains unexplained" : "nothing else stands out";
  const std::string where = study.ladder.split.by_flight
                                ? "on test flights"
                                : "on the flights of the fit (too few to hold any back)";
  if (study.before.all.overall.statistics.samples == 0)
    return "No record of these flights can be judged: " + why_nothing_is_judged(study) + ".";
  if (!study.ladder.too_poor.empty())
    return fmt::format("Vertical error (RMS) {} {}; no effect can be fitted: {}.",
                       shown(vertical_N(study.before.all)), unit.name, study.ladder.too_poor);
  if (added.empty())
    return fmt::format("Vertical error (RMS) {} {} {}; no effect lowers it, and {}.", where,
                       shown(vertical_N(study.before.test)), unit.name, left);
  return fmt::format("Vertical error (RMS) {} {} {}, after adding {} {} {}; {}.", where,
                     shown(vertical_N(study.before.test)), unit.name, listed(added),
                     shown(vertical_N(study.after.test)), unit.name, left);
}

void add_study(const Study& study, const residuals::Inputs& inputs, files::Json& result) {
  result["before"] = json_of(study.before);
  result["after"] = json_of(study.after);
  add_ladder(study.ladder, inputs, result);
  add_diagnoses({study.diagnosis}, result);
  files::Json next = files::Json::array();
  for (const std::string& flight : next_flights(study.diagnosis)) next.push_back(flight);
  result["next"] = std::move(next);
}

void print_study(const Study& study, const residuals::ForceUnit& unit) {
  fmt::print("{}\n", headline(study, unit));
  constexpr std::size_t kMostRows = 6, kMostNext = 2;
  std::size_t rows = 0;
  if (!study.ladder.rows.empty()) fmt::print("RMSE of the force residual (estimates; all axes):\n");
  for (const stability::LadderRow& row : study.ladder.rows) {
    if (!row.accepted || ++rows > kMostRows) continue;
    fmt::print("  {:<24} fit {:>8.3g}  select {:>8.3g}  test {:>8.3g} {}\n",
               (row.effect == "nominal" ? "" : "+ ") + row.effect, row.fit_rmse_N * unit.per_newton(),
               row.select_rmse_N * unit.per_newton(), row.test_rmse_N * unit.per_newton(), unit.name);
  }
  const std::vector<std::string> next = next_flights(study.diagnosis);
  for (std::size_t i = 0; i < next.size() && i < kMostNext; ++i) fmt::print("  fly {}\n", next[i]);
}

files::Json changed_json(const std::vector<identification::Difference>& differences,
                         const residuals::Inputs& inputs, const residuals::Inputs& others, int jobs) {
  std::vector<identification::Diagnosis> diagnoses;
  for (const identification::Difference& difference : differences) diagnoses.push_back(difference.diagnosis);
  files::Json all = files::Json::object();
  add_diagnoses(diagnoses, all);
  judge_rotors(inputs, others, jobs, false, all);
  return {{"verdict", all["verdict"]}, {"ranking", all["ranking"]}, {"rotors", all["rotors"]}};
}

void add_changes(const Changes& changes, const std::vector<std::string>& other_files, files::Json& result) {
  add_differences(changes.differences, other_files, result);
  result["changed"] = changes.judged;
}

std::vector<std::string> in_words(const Changes& changes) {
  std::vector<std::string> sentences;
  for (const identification::Difference& difference : changes.differences) {
    const identification::Diagnosis& diagnosis = difference.diagnosis;
    std::vector<std::string> effects;
    for (const identification::Missing& missing : diagnosis.ranking) effects.push_back(missing.effect);
    sentences.push_back(difference.vehicle + ": " +
                        (!diagnosis.too_poor.empty() ? "no answer, " + diagnosis.too_poor
                         : effects.empty() ? "no effect changed beyond the scatter of the other flights"
                                           : listed(effects) + " changed"));
  }
  for (const files::Json& rotor : changes.judged["rotors"]) {
    if (rotor["flight"].is_null() && !rotor["rotor"].is_null())
      sentences.push_back(rotor["vehicle"].get<std::string>() + ": " + rotor["statement"].get<std::string>());
  }
  if (sentences.empty()) sentences.emplace_back("no vehicle has usable records on both sides");
  return sentences;
}

void print_changes(const Changes& changes) {
  for (const std::string& sentence : in_words(changes))
    fmt::print("Against the other flights, {}.\n", sentence);
}

}  // namespace swarmcert::analysis
