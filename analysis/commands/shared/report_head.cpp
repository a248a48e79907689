#include "analysis/commands/shared/report_head.h"

#include <fmt/core.h>

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "analysis/cli/counted.h"
#include "analysis/residuals/force_unit.h"

namespace swarmcert::analysis {
namespace {

using residuals::TrackErrors;

/// Joins at most a few words, and counts the others.
std::string some_of(const std::vector<std::string>& words, const char* between = ", ") {
  constexpr std::size_t kMost = 5;
  std::string text;
  for (std::size_t i = 0; i < std::min(kMost, words.size()); ++i) text += (i == 0 ? "" : between) + words[i];
  if (words.size() > kMost) text += fmt::format("{}and {} more", between, words.size() - kMost);
  return text;
}

std::string model_words(const stability::Model& model) {
  std::vector<std::string> effects;
  for (const stability::EffectSpec& effect : model.effects) effects.push_back(effect.name);
  return fmt::format("{}: kind {}, {}, {}", model.path, model.kind, residuals::mass_text(model.mass_kg),
                     effects.empty() ? "no effects" : "effects " + some_of(effects));
}

std::string flight_words(const residuals::Inputs& inputs, const residuals::Comparison& comparison) {
  double used_s = 0;
  std::size_t judged = 0;
  for (const TrackErrors& track : comparison.tracks) {
    used_s += track.used_s;
    judged += track.position_only ? 0 : 1;
  }
  return fmt::format("{}, {}; {} records of {} are judged, {:.0f} s",
                     counted(inputs.found.flights.size(), "flight"), counted(comparison.tracks.size(), "log"),
                     comparison.overall.statistics.samples, counted(judged, "log"), used_s);
}

/// Records by the rule that cut them, most first.
std::vector<std::string> cut_words(const residuals::Comparison& comparison) {
  std::vector<std::pair<std::size_t, std::string>> cuts;
  for (int k = 1; k < static_cast<int>(residuals::Cut::kCount); ++k) {
    std::size_t records = 0;
    for (const TrackErrors& track : comparison.tracks) records += track.cut[static_cast<std::size_t>(k)];
    if (records > 0) cuts.emplace_back(records, residuals::rule(static_cast<residuals::Cut>(k)));
  }
  std::sort(cuts.rbegin(), cuts.rend());
  std::vector<std::string> words;
  for (const auto& [records, rule] : cuts) words.push_back(fmt::format("{} records: {}", records, rule));
  return words;
}

/// What is said of several logs, with their number, or with the name of the only one.
class Sayings {
 public:
  void add(const std::string& log, const std::string& words) { logs_[words].insert(log); }
  std::vector<std::string> all() const {
    std::vector<std::string> lines;
    for (const auto& [words, logs] : logs_)
      lines.push_back((logs.size() == 1 ? *logs.begin() : counted(logs.size(), "log")) + ": " + words);
    return lines;
  }

 private:
  std::map<std::string, std::set<std::string>> logs_;
};

}  // namespace

void add_report_head(Report& report, const residuals::Inputs& inputs, const residuals::Comparison& comparison,
                     const identification::Ladder* ladder) {
  std::vector<std::pair<std::string, std::string>> rows;
  const auto add = [&rows](const std::string& name, const std::vector<std::string>& words) {
    if (!words.empty()) rows.emplace_back(name, some_of(words, "; "));
  };
  for (const stability::Model& model : inputs.models) rows.emplace_back("model", model_words(model));
  rows.emplace_back("flights", flight_words(inputs, comparison));
  if (ladder != nullptr && ladder->split.by != identification::Split::By::kNothing) {
    const auto add_use = [&](const char* use, const std::vector<int>& which) {
      std::vector<std::string> names;
      for (const int i : which)
        if (static_cast<std::size_t>(i) < ladder->flights.size())
          names.push_back(ladder->flights[static_cast<std::size_t>(i)]);
      add(use, names.empty() ? names : std::vector<std::string>{some_of(names)});
    };
    add_use("fitted", ladder->split.fit);
    add_use("selecting", ladder->split.select);
    add_use("held out", ladder->split.test);
  }
  std::vector<std::string> left_out;
  for (const std::string& log : inputs.found.left_out)
    left_out.push_back(log + ": flights.toml leaves it out");
  for (const auto& [copy, of] : inputs.found.copies) left_out.push_back(copy + ": a copy of " + of);
  add("left out", left_out);
  Sayings positions, warnings;
  for (const std::string& problem : comparison.problems) {
    const std::size_t colon = problem.find(": ");
    if (colon == std::string::npos)
      warnings.add("all", problem);
    else
      warnings.add(problem.substr(0, colon), problem.substr(colon + 2));
  }
  for (const TrackErrors& track : comparison.tracks) {
    const std::string log = track.flight + " " + track.vehicle;
    for (const logs::Doubt& doubt : track.doubts)
      (track.position_only && doubt.refuses_force ? positions : warnings).add(log, doubt.words);
    for (const std::string& finding : track.findings) warnings.add(log, finding);
  }
  add("only as neighbours", positions.all());
  add("cut", cut_words(comparison));
  add("warnings", warnings.all());
  report.facts(rows);
}

}  // namespace swarmcert::analysis
