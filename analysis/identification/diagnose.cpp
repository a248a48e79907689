#include "analysis/identification/diagnose.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>

#include "analysis/identification/closed_loop.h"
#include "analysis/identification/scan/named_forms.h"
#include "analysis/identification/torque_balance.h"
#include "stability/effects/registry.h"

namespace swarmcert::identification {
namespace {

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
    const std::string& name = selected.refined[i].candidate.name;
    const std::vector<std::string> rivals = known[i].confounded_with();
    const bool has_substitute = !selected.instead.empty() && (is_scale(name) || name == "constant_force");
    if (has_substitute && name != selected.instead &&
        std::find(rivals.begin(), rivals.end(), selected.instead) == rivals.end())
      known[i].rivals.push_back({selected.instead, stability::effect_info(selected.instead).excitation});
    ranking.push_back(missing_of(passes, selected.refined[i], std::move(known[i]), selected.grams));
    if (!selected.checks.empty()) ranking.back().instrument = selected.checks[i];
  }
  return ranking;
}

/// Names whose shape ended at a bound of its parameters, other than where it starts: what they fit is something else.
/// Effects of neighbours act where neighbours are, which nothing else does: their shapes may end anywhere.
std::set<std::string> out_of_bounds(const Selected& selected) {
  std::set<std::string> names;
  for (const Refined& refined : selected.refined) {
    const stability::EffectInfo& info = refined.candidate.info;
    if (info.remembers || info.needs_neighbours || is_formula(refined.candidate.name)) continue;
    for (std::size_t i = 0; i < refined.theta.size(); ++i) {
      const stability::Parameter& p = info.shape[i];
      if (p.grid.empty() || !(p.lower < p.upper)) continue;
      const bool at_lower = refined.theta[i] <= p.lower && p.value > p.lower;
      const bool at_upper = refined.theta[i] >= p.upper && p.value < p.upper;
      if (at_lower || at_upper) names.insert(refined.candidate.name);
    }
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

/// @param rivals that compete with the names that are always candidates
/// @param start effects where selection begins
Settled settle(const Passes& passes, const Coverage& covered, const std::vector<Candidate>& rivals,
               const std::vector<std::string>& start) {
  constexpr int kMostRounds = 8;
  std::vector<Candidate> candidates = all_candidates(*passes.inputs.model_of(passes.kind), covered);
  candidates.insert(candidates.end(), rivals.begin(), rivals.end());
  Settled result;
  bool doubts_slope = false;
  for (int round = 0; round < kMostRounds; ++round) {
    result.selected =
        doubts_slope ? without_slope(passes, candidates, {}) : select(passes, candidates, start);
    std::set<std::string> doubtful = out_of_bounds(result.selected);
    doubtful.merge(unconfirmed_loads(result.selected));
    if (!doubtful.empty() && round + 1 < kMostRounds) {
      result.suspected.insert(result.suspected.end(), doubtful.begin(), doubtful.end());
      erase(candidates, doubtful);
      continue;
    }
    result.ranking = ranking_of(passes, result.selected);
    result.rest = remainder(passes, specs_of(result.ranking));
    if (result.rest.ratio <= kLoudRatio) break;
    std::set<std::string> names = suspects(result.selected);
    if (names.empty()) break;
    const bool has_scale = std::any_of(names.begin(), names.end(), is_scale);
    if (has_scale && !doubts_slope && has_vertical_push(result.selected.refined)) {
      doubts_slope = true;
      continue;
    }
    if (has_scale) doubts_slope = false;
    result.suspected.insert(result.suspected.end(), names.begin(), names.end());
    erase(candidates, with_substitutes(names, result.selected.refined));
  }
  return result;
}

bool is_named(const Missing& missing) { return !is_formula(missing.effect); }

/// Names that stand against formulas, and what is left beside them.
struct Explained {
  Settled settled;
  Scan scan;
  std::vector<Formula> formulas;
};

/// Formulas for what the model leaves, and for what it leaves beside the names: those that may take a name's place.
std::vector<Formula> rivals_of_names(const Passes& passes, const Explained& explained) {
  constexpr std::size_t kOfEach = 3;
  std::vector<Formula> rivals;
  const auto add = [&](const std::vector<Formula>& formulas) {
    for (std::size_t i = 0; i < std::min(kOfEach, formulas.size()); ++i) {
      const bool is_known = std::any_of(rivals.begin(), rivals.end(), [&](const Formula& other) {
        return other.effect.name == formulas[i].effect.name;
      });
      if (!is_known) rivals.push_back(formulas[i]);
    }
  };
  if (explained.settled.ranking.empty()) {
    add(explained.formulas);
    return rivals;
  }
  const ScanSamples nominal = scan_samples(passes, {});
  add(find_formulas(nominal, scan(nominal, passes.jobs), kOfEach, passes.jobs));
  add(explained.formulas);
  return rivals;
}

void scan_what_is_left(const Passes& passes, Explained& explained) {
  const ScanSamples left = scan_samples(passes, specs_of(explained.settled.ranking));
  explained.scan = scan(left, passes.jobs);
  explained.formulas = find_formulas(left, explained.scan, kMostFormulas, passes.jobs);
}

bool is_answer_of_thrust(const Missing& missing) {
  const std::vector<std::string> library = stability::effect_names();
  if (std::find(library.begin(), library.end(), missing.effect) == library.end()) return false;
  const stability::EffectInfo& info = stability::effect_info(missing.effect);
  return info.remembers || is_scale(missing.effect) || is_of_load(missing.effect) ||
         missing.effect == "inflow";
}

/// Where one variable explains most of what is left, thrust and its history answer it: names of that kind that explain
/// less than the variable does are suspects.
void doubt_answers(const Passes& passes, Explained& explained) {
  constexpr double kMost = 0.5;
  if (explained.scan.entries.empty() || explained.scan.entries[0].share < kMost) return;
  const ScanEntry& first = explained.scan.entries[0];
  const auto squared = [](double value) { return value * value; };
  const double left = squared(first.rmse_before) - squared(first.rmse_after);
  std::vector<Missing>& ranking = explained.settled.ranking;
  const auto doubtful = std::stable_partition(ranking.begin(), ranking.end(), [&](const Missing& missing) {
    const Finding& finding = missing.finding;
    return !is_answer_of_thrust(missing) ||
           squared(finding.rmse_before_N) - squared(finding.rmse_after_N) > left;
  });
  if (doubtful == ranking.end()) return;
  for (auto it = doubtful; it != ranking.end(); ++it) explained.settled.suspected.push_back(it->effect);
  ranking.erase(doubtful, ranking.end());
  explained.settled.rest = remainder(passes, specs_of(ranking));
  scan_what_is_left(passes, explained);
}

/// A scale of the thrust that halves the error. Where thrust hardly varies, formulas of anything can say the same.
bool has_plain_scale(const std::vector<Missing>& ranking) {
  constexpr double kHalf = 0.5;
  return std::any_of(ranking.begin(), ranking.end(), [](const Missing& missing) {
    return is_scale(missing.effect) && missing.finding.rmse_after_N <= kHalf * missing.finding.rmse_before_N;
  });
}

/// settle() without formulas that only take back what a scale of the thrust says too much.
Settled settle_with_formulas(const Passes& passes, const Coverage& covered, std::vector<Candidate> rivals,
                             const std::vector<std::string>& names) {
  constexpr int kMostRounds = 4;
  Settled result = settle(passes, covered, rivals, names);
  for (int round = 1; round < kMostRounds; ++round) {
    const std::set<std::string> substitutes = substitutes_of_scales(result.selected);
    if (substitutes.empty()) break;
    erase(rivals, substitutes);
    result = settle(passes, covered, rivals, names);
  }
  return result;
}

/// A name stands only if it explains about as much as the best formula would in its place: where formulas win, the
/// selection is done anew with them among the candidates, and they are what is left. Names that only formulas point to
/// take part as well.
Explained explain_by_formulas(const Passes& passes, const Coverage& covered) {
  constexpr double kClearlyLess = 0.9;  // of the mean square: names are worth a little
  Explained result;
  result.settled = settle(passes, covered, {}, {});
  scan_what_is_left(passes, result);
  const std::vector<Formula> formulas = rivals_of_names(passes, result);
  const stability::Model& model = *passes.inputs.model_of(passes.kind);
  std::vector<Candidate> rivals = named_forms(formulas, model, covered);
  if (rivals.empty() && (formulas.empty() || result.settled.ranking.empty())) return result;
  for (const Formula& formula : formulas) rivals.push_back(candidate_of(formula, model));
  std::vector<std::string> names;
  for (const Missing& missing : result.settled.ranking) names.push_back(missing.effect);
  Settled again = settle_with_formulas(passes, covered, rivals, names);
  const auto is_known = [](const Missing& missing) {
    return is_named(missing) && !needs_scan(missing.effect);
  };
  if (std::all_of(again.ranking.begin(), again.ranking.end(), is_known)) return result;
  if (has_plain_scale(result.settled.ranking) && !has_plain_scale(again.ranking)) return result;
  const double left = Selection(again.selected.grams).mean_square(again.selected.members);
  const Selection by_names(result.settled.selected.grams);
  if (!(left < kClearlyLess * by_names.mean_square(result.settled.selected.members))) return result;
  again.ranking.erase(std::stable_partition(again.ranking.begin(), again.ranking.end(), is_named),
                      again.ranking.end());
  again.rest = remainder(passes, specs_of(again.ranking));
  result.settled = std::move(again);
  scan_what_is_left(passes, result);
  return result;
}

Explained explain(const Passes& passes, const Coverage& covered) {
  Explained explained = explain_by_formulas(passes, covered);
  doubt_answers(passes, explained);
  return explained;
}

double own_ratio(const stability::Model& model) {
  double sum = 0;
  for (const stability::EffectSpec& spec : model.effects) {
    const auto ratio = spec.parameters.find("ratio");
    if (spec.name == "thrust_ratio" && ratio != spec.parameters.end()) sum += ratio->second;
  }
  return sum;
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
  const double own = own_ratio(model);
  scale.value.least_squares += own;
  scale.value.instrument += own;
  scale.value.interval = {scale.value.interval.first + own, scale.value.interval.second + own};
  return scale;
}

/// Where set points show a scale of the thrust that least squares have put down to a constant force, that force says
/// so: thrust that hardly varies looks like one, and thrust that answers disturbances hides the rest.
void name_hidden_scale(const stability::Model& model, const ThrustScale& scale,
                       std::vector<Missing>& ranking) {
  constexpr double kSurely = 2;  // half widths of the 90 % interval
  const Interval& interval = scale.value.interval;
  const double excess = std::abs(scale.value.instrument - own_ratio(model));
  if (!scale.is_known || excess <= kSurely * (interval.second - interval.first) / 2) return;
  const auto names_scale = [](const Missing& missing) { return missing.effect == "thrust_ratio"; };
  if (std::any_of(ranking.begin(), ranking.end(), names_scale)) return;
  for (Missing& missing : ranking) {
    if (missing.effect != "constant_force") continue;
    const std::vector<std::string> rivals = missing.finding.confounded_with();
    if (std::find(rivals.begin(), rivals.end(), "thrust_ratio") != rivals.end()) continue;
    missing.finding.rivals.push_back({"thrust_ratio", stability::effect_info("thrust_ratio").excitation});
  }
}

/// Whether a curve of the scan explains as much as a constant share of the thrust, or more: then it is no matter of scale.
bool is_explained_by_curve(const Scan& scan, double rmse_N) {
  return std::any_of(scan.entries.begin(), scan.entries.end(), [&](const ScanEntry& entry) {
    return entry.variable != "thrust" && entry.variable != "body_constant" && entry.rmse_after <= rmse_N;
  });
}

/// What halves the error is named even where set points do not confirm it: at least as one of a class, with the rivals
/// that halve it as well. Only scales of the thrust and a constant force are so plain without knowing more.
void name_what_halves(const Passes& passes, Diagnosis& result) {
  constexpr double kQuarter = 0.25;  // of the mean square
  if (result.suspected.empty() && result.contradicted.empty() && result.scan.entries.empty()) return;
  const residuals::Inputs left = inputs_with(passes, specs_of(result.ranking));
  const std::vector<int> flights = every_flight(left);
  const Coverage covered = coverage(left, passes.kind, flights, passes.jobs);
  std::vector<Candidate> candidates;
  for (const char* const name : {"thrust_ratio", "battery", "constant_force"})
    candidates.push_back(candidate(name, *left.model_of(passes.kind), covered));
  const Grams grams = block_grams(left, passes.kind, candidates, flights, passes.jobs, [](int, int) {});
  const Selection selection(grams);
  if (!selection.is_sound()) return;
  const double before = selection.mean_square({});
  std::vector<std::string> names;
  double least = kQuarter * before;
  for (int k = 0; k < static_cast<int>(candidates.size()); ++k) {
    const double square = selection.mean_square({selection.best_theta({}, k)});
    if (square > kQuarter * before) continue;
    names.push_back(candidates[static_cast<std::size_t>(k)].name);
    least = std::min(least, square);
  }
  if (names.empty() || is_explained_by_curve(result.scan, std::sqrt(least))) return;
  std::vector<Missing> found =
      fit_effects(left, passes.kind, {names[0]}, flights, passes.jobs, [](int, int) {});
  for (std::size_t i = 1; i < names.size(); ++i) {
    std::vector<Rival>& rivals = found[0].finding.rivals;
    const bool is_known = std::any_of(rivals.begin(), rivals.end(),
                                      [&](const Rival& rival) { return rival.effect == names[i]; });
    if (!is_known) rivals.push_back({names[i], stability::effect_info(names[i]).excitation});
  }
  result.ranking.insert(result.ranking.begin(), std::move(found[0]));
  result.rmse_after_N = std::sqrt(least);
  const auto drop = [&](std::vector<std::string>& list) {
    list.erase(std::remove(list.begin(), list.end(), names[0]), list.end());
  };
  drop(result.suspected);
  drop(result.contradicted);
}

/// What the means of the torques name, unless one rotor may be the cause: that is for the scan to say.
std::vector<stability::EffectSpec> named_balances(const Passes& passes) {
  std::vector<stability::EffectSpec> specs;
  const residuals::Inputs inputs = inputs_with(passes, {});
  for (const TorqueBalance& balance : torque_balances(inputs, passes.kind, passes.jobs)) {
    const auto& rivals = balance.rivals;
    if (balance.is_named() && std::find(rivals.begin(), rivals.end(), "rotor_thrust") == rivals.end())
      specs.push_back(spec_of(balance, balance.effect));
  }
  return specs;
}

/// What the torques and the rotors leave beside what is named.
void scan_balance(const Passes& passes, Diagnosis& result) {
  std::vector<stability::EffectSpec> specs = specs_of(result.ranking);
  for (stability::EffectSpec& spec : named_balances(passes)) specs.push_back(std::move(spec));
  // An hour: more say hardly more, and take as long as the force.
  constexpr Eigen::Index kMostOfBalance = 40'000;
  const ScanSamples left = thinned(scan_samples(passes, specs, ScanQuantity::kBalance), kMostOfBalance);
  result.balance = scan(left, passes.jobs);
  result.balance_formulas = find_formulas(left, result.balance, kMostFormulas, passes.jobs);
}

/// candidate(), at the place where a scan of what the model leaves beside `others` finds it if that is how it is found.
Candidate candidate_to_fit(const Passes& passes, const std::string& name, const Coverage& covered,
                           const std::vector<stability::EffectSpec>& others) {
  const stability::Model& model = *passes.inputs.model_of(passes.kind);
  Candidate result = candidate(name, model, covered);
  if (!needs_scan(name)) return result;
  const ScanSamples samples = scan_samples(passes, others);
  const std::vector<Formula> formulas =
      find_formulas(samples, scan(samples, passes.jobs), kMostFormulas, passes.jobs);
  for (Candidate& found : named_forms(formulas, model, covered)) {
    if (found.name == name) return std::move(found);
  }
  return result;
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
  Explained explained = explain(passes, covered);
  Settled& settled = explained.settled;
  const Selected& selected = settled.selected;
  const Selection selection(selected.grams);
  result.ranking = std::move(settled.ranking);
  result.contradicted = selected.contradicted;
  result.suspected = std::move(settled.suspected);
  result.rmse_before_N = std::sqrt(selection.mean_square({}));
  Members named;
  for (const Member& member : selected.members) {
    if (!is_formula(selection.candidate(member).name)) named.push_back(member);
  }
  result.rmse_after_N = std::sqrt(selection.mean_square(named));
  result.detectable = detectable(selected.grams, named);
  result.detectable.erase(std::remove_if(result.detectable.begin(), result.detectable.end(),
                                         [](const Detectable& entry) {
                                           return is_formula(entry.effect) || needs_scan(entry.effect);
                                         }),
                          result.detectable.end());
  result.thrust_scale = thrust_scale(passes, covered);
  name_hidden_scale(*inputs.model_of(kind), result.thrust_scale, result.ranking);
  result.remainder = std::move(settled.rest);
  result.scan = std::move(explained.scan);
  result.formulas = std::move(explained.formulas);
  name_what_halves(passes, result);
  scan_balance(passes, result);
  return result;
}

std::vector<Missing> missing_effects(const residuals::Inputs& inputs, const std::string& kind,
                                     const std::vector<int>& which, int jobs,
                                     const residuals::Progress& progress) {
  return diagnose(inputs, kind, which, jobs, progress).ranking;
}

std::vector<Missing> fit_effects(const residuals::Inputs& inputs, const std::string& kind,
                                 const std::vector<std::string>& names, const std::vector<int>& which,
                                 int jobs, const residuals::Progress& progress) {
  const Coverage covered = coverage(inputs, kind, which, jobs);
  const Passes passes = {inputs, kind, which, covered.records, jobs, progress};
  std::vector<Candidate> candidates;
  std::vector<std::string> others;
  std::remove_copy_if(names.begin(), names.end(), std::back_inserter(others), needs_scan);
  std::vector<stability::EffectSpec> beside;
  if (others.size() < names.size() && !others.empty())
    beside = specs_of(fit_effects(inputs, kind, others, which, jobs, progress));
  for (const std::string& name : names) candidates.push_back(candidate_to_fit(passes, name, covered, beside));
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
