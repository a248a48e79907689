#include "analysis/commands/study/study_output.h"

#include <fmt/core.h>

#include <algorithm>
#include <utility>

#include "analysis/commands/diagnose/diagnose_output.h"
#include "analysis/commands/diagnose/rotor_output.h"
#include "analysis/commands/shared/character_plot.h"
#include "analysis/report/report_text.h"

namespace swarmcert::analysis {
namespace {

using identification::Study;
using identification::StudyErrors;

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

/// "26.5 mN, most along y": the root mean square of the residual vector.
std::string error_words(const residuals::Comparison& comparison, const residuals::ForceUnit& unit) {
  const residuals::ErrorStatistics& s = comparison.overall.statistics;
  const int axis = residuals::failing_axis(s);
  const double along = axis == 0 ? s.rmse.x : axis == 1 ? s.rmse.y : s.rmse.z;
  constexpr double kMost = 0.5;  // of the mean square
  return fmt::format(
      "{:.3g} {}{}", s.rmse.total * unit.per_newton(), unit.name,
      along * along > kMost * s.rmse.total * s.rmse.total ? fmt::format(", most along {}", "xyz"[axis]) : "");
}

/// The comparison from which the headline is read: of what is held out, if anything is.
const residuals::Comparison& judged(const StudyErrors& errors) {
  return errors.test.overall.statistics.samples > 0 ? errors.test : errors.all;
}

/// The mean over all steps of a prediction.
std::string mean_position_error(const Prediction& prediction) {
  const double mean_m =
      prediction.errors[residuals::kPositionError].sum() / static_cast<double>(prediction.steps());
  return fmt::format("{:.3g} mm", 1000 * mean_m);
}

std::string left_words(const StudyResult& result) {
  if (result.left.where != residuals::FailingPlace::Where::kNowhere)
    return "it still fails " + result.left.words;
  const std::string variable = adds_forms(result) ? "" : varies_with(result.study.diagnosis);
  return variable.empty() ? "nothing else stands out"
                          : "a part of what is left still varies with " + variable;
}

std::string first_log(const residuals::Inputs& inputs) {
  const std::vector<std::string> logs = residuals::log_files(inputs.found);
  return logs.empty() ? "" : logs[0];
}

}  // namespace

bool adds_forms(const StudyResult& result) {
  const auto& named = result.study.diagnosis.ranking;
  return std::any_of(result.causes.begin(), result.causes.end(), [&](const Cause& cause) {
    return std::none_of(named.begin(), named.end(),
                        [&](const identification::Missing& missing) { return missing.effect == cause.name; });
  });
}

std::string headline(const StudyResult& result, const residuals::ForceUnit& unit) {
  const Study& study = result.study;
  if (study.before.all.overall.statistics.samples == 0)
    return "No record of these flights can be judged: " + why_nothing_is_judged(study) + ".";
  const std::string before = error_words(judged(study.before), unit);
  if (!study.ladder.too_poor.empty())
    return fmt::format("Error of the force (RMS) {}; no effect can be fitted: {}.", before,
                       study.ladder.too_poor);
  std::vector<std::string> added;
  for (const Cause& cause : result.causes) added.push_back(cause.name);
  const std::string where = where_held_out(study.ladder);
  if (added.empty())
    return fmt::format("Error of the force (RMS) on {}: {}; no effect lowers it.", where, before);
  const double floor_N = study.ladder.rows.back().noise_floor_N;
  return fmt::format("Error of the force (RMS) on {}: {}. After adding {}: {}{}; {}.", where, before,
                     listed(added), error_words(judged(study.after), unit),
                     floor_N > 0 ? fmt::format(" (noise {:.3g})", floor_N * unit.per_newton()) : "",
                     left_words(result));
}

std::vector<std::string> conclusions(const StudyResult& result, const residuals::ForceUnit& unit) {
  if (result.study.before.all.overall.statistics.samples == 0) return {};
  std::vector<std::string> sentences = {residuals::sentence(result.fails)};
  for (const Cause& cause : result.causes) {
    sentences.push_back(sentence(cause, unit) + ".");
    sentences.push_back("  " + cause.equation);
  }
  if (result.predicted_before && result.predicted_after && !result.causes.empty()) {
    sentences.push_back(fmt::format(
        "Up to half a second ahead it predicts the position to {} on average; before, to {}.",
        mean_position_error(*result.predicted_after), mean_position_error(*result.predicted_before)));
  }
  const std::string& stopped = result.study.ladder.stopped;
  if (!stopped.empty()) sentences.push_back("The search ended: " + stopped + ".");
  return sentences;
}

std::string next_of_study(const Study& study, const FlightOptions& options, const residuals::Inputs& inputs,
                          const std::string& output) {
  const std::string& given = inputs.models[0].path;
  if (study.before.all.overall.statistics.samples == 0)
    return shell_line({"swarmcert", "inspect", first_log(inputs)});
  if (study.ladder.any_accepted)
    return next_command("compare", {output + "/fitted.toml"}, options, inputs, {"--horizon", "0.5"});
  if (residuals::failing_place(study.before.all, {}).where != residuals::FailingPlace::Where::kNowhere)
    return next_command("diagnose", {given}, options, inputs, {"--next"});
  return next_command("compare", {given}, options, inputs, {"--json", "errors.json"});
}

void print_study(const StudyResult& result, const residuals::ForceUnit& unit) {
  std::string answer = headline(result, unit);
  const std::size_t second = answer.find(". After");
  if (second != std::string::npos) answer[second + 1] = '\n';
  fmt::print("{}\n", answer);
  const std::vector<std::string> lines = conclusions(result, unit);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    fmt::print("  {}\n", lines[i]);
    if (i == 0) fmt::print("{}", character_plot(result.study.before.all, result.fails, unit));
  }
  constexpr std::size_t kMostNext = 2;
  for (std::size_t i = 0; i < result.next.size() && i < kMostNext; ++i)
    fmt::print("  fly {}\n", result.next[i]);
}

Changes changes_of(std::vector<identification::Difference> differences, const residuals::Inputs& inputs,
                   const residuals::Inputs& others, const std::vector<std::string>& other_files, int jobs) {
  std::vector<identification::Diagnosis> diagnoses;
  for (const identification::Difference& difference : differences) diagnoses.push_back(difference.diagnosis);
  Changes changes;
  changes.against = {other_files, std::move(differences)};
  changes.judgement = judgement_of(diagnoses);
  changes.rotors = judge_rotors(inputs, others, jobs, false, changes.judgement);
  return changes;
}

std::vector<std::string> in_words(const Changes& changes) {
  std::vector<std::string> sentences;
  for (const identification::Difference& difference : changes.against.differences) {
    const identification::Diagnosis& diagnosis = difference.diagnosis;
    std::vector<std::string> effects;
    for (const identification::Missing& missing : diagnosis.ranking) effects.push_back(missing.effect);
    sentences.push_back(difference.vehicle + ": " +
                        (!diagnosis.too_poor.empty() ? "no answer, " + diagnosis.too_poor
                         : effects.empty() ? "no effect changed beyond the scatter of the other flights"
                                           : listed(effects) + " changed"));
  }
  for (const identification::RotorBalance& rotor : changes.rotors)
    if (rotor.flight.empty() && rotor.rotor != 0)
      sentences.push_back(rotor.vehicle + ": " + identification::in_words(rotor));
  if (sentences.empty()) sentences.emplace_back("no vehicle has usable records on both sides");
  return sentences;
}

void print_changes(const Changes& changes) {
  for (const std::string& sentence : in_words(changes))
    fmt::print("Against the other flights, {}.\n", sentence);
}

}  // namespace swarmcert::analysis
