#include "analysis/identification/diagnose.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace swarmcert::identification {
namespace {

/// Where there are more records, thetas off the grid do not take part in a second selection.
constexpr std::size_t kManyRecords = 400'000;

/// What selection leaves: which effects, with which thetas.
struct Selected {
  Grams grams;
  Members members;
  std::vector<Refined> refined;  ///< of `members`, in their order
  std::vector<std::vector<InstrumentedValue>> checks;
  std::vector<std::string> contradicted;
};

std::vector<Candidate> candidates_of(const std::vector<Refined>& refined) {
  std::vector<Candidate> candidates;
  for (const Refined& r : refined) {
    candidates.push_back(r.candidate);
    // The gain of a lag is what the check is about.
    if (r.candidate.info.remembers) candidates.back().info.linear[0].lower = 0;
  }
  return candidates;
}

/// Index of the first effect that is only the controller's answer to something else; -1 if none.
int contradicted(const std::vector<Refined>& refined,
                 const std::vector<std::vector<InstrumentedValue>>& checks) {
  for (std::size_t i = 0; i < checks.size(); ++i) {
    if (refined[i].candidate.columns() == 1 && checks[i][0].contradicts()) return static_cast<int>(i);
  }
  return -1;
}

/// Selects on the grid, refines, and selects again with the refined thetas among the others, so that what a coarse
/// theta left does not count as another effect. Effects that the instrument contradicts are taken out.
Selected select(const Passes& passes, std::vector<Candidate> candidates) {
  constexpr int kMostRounds = 6;
  Selected result;
  std::set<std::string> named;
  bool reuse = false;
  for (int round = 0; round < kMostRounds; ++round) {
    if (!reuse) {
      result.grams =
          block_grams(passes.inputs, passes.kind, candidates, passes.flights, passes.jobs, passes.progress);
    }
    const Selection selection(result.grams);
    if (!selection.is_sound()) return result;
    result.members = selection.select();
    result.refined = refine(passes, result.grams, result.members);
    result.checks = instrument(passes, candidates_of(result.refined));
    if (const int bad = contradicted(result.refined, result.checks); bad >= 0) {
      const std::string& name = result.refined[static_cast<std::size_t>(bad)].candidate.name;
      result.contradicted.push_back(name);
      candidates.erase(std::remove_if(candidates.begin(), candidates.end(),
                                      [&](const Candidate& c) { return c.name == name; }),
                       candidates.end());
      continue;
    }
    std::set<std::string> now;
    bool moved = false;
    for (std::size_t i = 0; i < result.members.size(); ++i) {
      const Refined& refined = result.refined[i];
      now.insert(refined.candidate.name);
      Candidate& candidate = candidates[static_cast<std::size_t>(result.members[i].candidate)];
      if (std::find(candidate.thetas.begin(), candidate.thetas.end(), refined.theta) ==
          candidate.thetas.end()) {
        candidate.thetas.push_back(refined.theta);
        moved = true;
      }
    }
    if (!moved || now == named || passes.records > kManyRecords) break;
    named = now;
  }
  widen_by_bias(result.checks, instrument_with_shapes(passes, result.refined), result.refined);
  return result;
}

Missing missing_of(const Passes& passes, const Refined& refined, Finding finding, const Grams& grams) {
  const Candidate& candidate = refined.candidate;
  Missing missing;
  missing.effect = candidate.name;
  missing.equivalence_class = candidate.info.equivalence_class;
  missing.kind = passes.kind;
  missing.excitation = candidate.info.excitation;
  for (std::size_t c = 0; c < refined.coefficients.size(); ++c) {
    const std::string& name = candidate.info.linear[c].name;
    missing.coefficients.push_back(name);
    missing.parameters[name] = refined.coefficients[c];
    missing.intervals[name] = refined.linear_intervals[c];
  }
  for (std::size_t i = 0; i < refined.theta.size(); ++i) {
    const std::string& name = candidate.info.shape[i].name;
    missing.parameters[name] = refined.theta[i];
    const Interval& interval = refined.shape_intervals[i];
    if (interval.first < interval.second) missing.intervals[name] = interval;
  }
  missing.specs = specs_of(candidate, refined.coefficients, refined.theta, refined.linear_intervals,
                           refined.shape_intervals);
  std::set<int> flights;
  for (const Block& block : grams.blocks) flights.insert(block.flight);
  for (stability::EffectSpec& spec : missing.specs) {
    spec.fit = {{}, spec.fit.interval, 0, 0, 0, ""};
    for (const int flight : flights)
      spec.fit.flights.push_back(passes.inputs.found.flights[static_cast<std::size_t>(flight)].name);
  }
  missing.finding = std::move(finding);
  return missing;
}

std::vector<Missing> ranking_of(const Passes& passes, const Selected& selected) {
  std::vector<Finding> known = findings(Selection(selected.grams), selected.members);
  std::vector<Missing> ranking;
  for (std::size_t i = 0; i < known.size(); ++i) {
    ranking.push_back(missing_of(passes, selected.refined[i], std::move(known[i]), selected.grams));
    if (!selected.checks.empty()) ranking.back().instrument = selected.checks[i];
  }
  return ranking;
}

/// Thrust answers whatever disturbs the vehicle: what its history seems to do needs another witness.
bool is_of_thrust(const Candidate& candidate) {
  const std::string& name = candidate.name;
  return candidate.info.remembers || name == "thrust_ratio" || name == "battery" || name == "inflow";
}

/// The instrument says the same of the effect's coefficient.
bool is_confirmed(const std::vector<InstrumentedValue>& check) {
  constexpr double kAlike = 0.25;
  return std::all_of(check.begin(), check.end(), [](const InstrumentedValue& value) {
    return value.is_strong() &&
           std::abs(value.instrument - value.least_squares) <= kAlike * std::abs(value.least_squares);
  });
}

/// Names of selected effects that are no match for a loud remainder, see Diagnosis::suspected.
std::set<std::string> suspects(const Selected& selected) {
  constexpr double kShare = 0.1;
  const Selection selection(selected.grams);
  const double square = selection.mean_square(selected.members);
  std::set<std::string> names;
  for (std::size_t i = 0; i < selected.members.size(); ++i) {
    const Candidate& candidate = selected.refined[i].candidate;
    const bool small = square > (1 - kShare) * selection.mean_square(without(selected.members, i));
    const bool unconfirmed =
        is_of_thrust(candidate) && (selected.checks.empty() || !is_confirmed(selected.checks[i]));
    if (small || unconfirmed) names.insert(candidate.name);
  }
  return names;
}

/// What is selected once nothing of it is suspect.
struct Settled {
  Selected selected;
  std::vector<Missing> ranking;
  Remainder rest;
  std::vector<std::string> suspected;
};

Settled settle(const Passes& passes, const Coverage& covered) {
  constexpr int kMostRounds = 8;
  std::vector<Candidate> candidates = all_candidates(*passes.inputs.model_of(passes.kind), covered);
  Settled result;
  for (int round = 0; round < kMostRounds; ++round) {
    result.selected = select(passes, candidates);
    result.ranking = ranking_of(passes, result.selected);
    result.rest = remainder(passes, specs_of(result.ranking));
    if (result.rest.ratio <= kLoudRatio) break;
    std::set<std::string> names = suspects(result.selected);
    if (names.empty()) break;
    result.suspected.insert(result.suspected.end(), names.begin(), names.end());
    // A scale that follows the battery would only take the place of the scale that is too doubtful.
    if (names.count("thrust_ratio") == 1) names.insert("battery");
    candidates.erase(std::remove_if(candidates.begin(), candidates.end(),
                                    [&](const Candidate& c) { return names.count(c.name) == 1; }),
                     candidates.end());
  }
  return result;
}

ThrustScale thrust_scale(const Passes& passes, const Coverage& covered) {
  const stability::Model& model = *passes.inputs.model_of(passes.kind);
  const auto checks = instrument(
      passes, {candidate("thrust_ratio", model, covered), candidate("constant_force", model, covered)});
  ThrustScale scale;
  if (checks.empty()) return scale;
  scale.is_known = true;
  scale.value = checks[0][0];
  // The model's own ratio counts as well.
  for (const stability::EffectSpec& spec : model.effects) {
    const auto ratio = spec.parameters.find("ratio");
    const double offset = spec.name == "thrust_ratio" && ratio != spec.parameters.end() ? ratio->second : 0;
    scale.value.least_squares += offset;
    scale.value.instrument += offset;
    scale.value.interval = {scale.value.interval.first + offset, scale.value.interval.second + offset};
  }
  return scale;
}

}  // namespace

std::vector<int> every_flight(const residuals::Inputs& inputs) {
  std::vector<int> all;
  for (std::size_t i = 0; i < inputs.found.flights.size(); ++i) all.push_back(static_cast<int>(i));
  return all;
}

std::vector<stability::EffectSpec> specs_of(const std::vector<Missing>& missing) {
  std::vector<stability::EffectSpec> specs;
  for (const Missing& m : missing) specs.insert(specs.end(), m.specs.begin(), m.specs.end());
  return specs;
}

Diagnosis diagnose(const residuals::Inputs& inputs, const std::string& kind, const std::vector<int>& which,
                   int jobs, const residuals::Progress& progress) {
  Diagnosis result;
  result.kind = kind;
  const Coverage covered = coverage(inputs, kind, which, jobs);
  result.records = covered.records;
  result.flights = static_cast<int>(which.size());
  result.blocks = covered.blocks;
  result.too_poor = covered.too_poor();
  result.problems = covered.problems;
  if (!result.too_poor.empty()) return result;
  const Passes passes = {inputs, kind, which, covered.records, jobs, progress};
  Settled settled = settle(passes, covered);
  const Selected& selected = settled.selected;
  const Selection selection(selected.grams);
  result.ranking = std::move(settled.ranking);
  result.contradicted = selected.contradicted;
  result.suspected = std::move(settled.suspected);
  result.rmse_before_N = std::sqrt(selection.mean_square({}));
  result.rmse_after_N = std::sqrt(selection.mean_square(selected.members));
  result.detectable = detectable(selected.grams, selected.members);
  result.thrust_scale = thrust_scale(passes, covered);
  result.remainder = std::move(settled.rest);
  return result;
}

std::vector<Missing> missing_effects(const residuals::Inputs& inputs, const std::string& kind,
                                     const std::vector<int>& which, int jobs,
                                     const residuals::Progress& progress) {
  const Coverage covered = coverage(inputs, kind, which, jobs);
  return settle({inputs, kind, which, covered.records, jobs, progress}, covered).ranking;
}

std::vector<Missing> fit_effects(const residuals::Inputs& inputs, const std::string& kind,
                                 const std::vector<std::string>& names, const std::vector<int>& which,
                                 int jobs, const residuals::Progress& progress) {
  const Coverage covered = coverage(inputs, kind, which, jobs);
  const Passes passes = {inputs, kind, which, covered.records, jobs, progress};
  std::vector<Candidate> candidates;
  for (const std::string& name : names)
    candidates.push_back(candidate(name, *inputs.model_of(kind), covered));
  Selected selected;
  selected.grams = block_grams(inputs, kind, candidates, which, jobs, progress);
  const Selection selection(selected.grams);
  for (int round = 0; round < 3; ++round) {
    for (std::size_t i = 0; i < names.size(); ++i) {
      const Members rest = round == 0 ? selected.members : without(selected.members, i);
      const Member best = selection.best_theta(rest, static_cast<int>(i));
      if (round == 0)
        selected.members.push_back(best);
      else
        selected.members[i] = best;
    }
  }
  selected.refined = refine(passes, selected.grams, selected.members);
  selected.checks = instrument(passes, candidates_of(selected.refined));
  widen_by_bias(selected.checks, instrument_with_shapes(passes, selected.refined), selected.refined);
  return ranking_of(passes, selected);
}

}  // namespace swarmcert::identification
