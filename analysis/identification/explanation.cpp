#include "analysis/identification/explanation.h"

#include <algorithm>
#include <optional>
#include <set>

#include "analysis/identification/evidence/explanations.h"
#include "analysis/identification/scan/drag_law.h"
#include "analysis/identification/scan/named_forms.h"
#include "analysis/identification/swinging_load.h"
#include "stability/effects/registry.h"

namespace swarmcert::identification {
namespace {

/// Returns whether the registry has the effect.
bool is_of_library(const std::string& effect) {
  const std::vector<std::string> names = stability::effect_names();
  return std::find(names.begin(), names.end(), effect) != names.end();
}

/// Returns whether a coefficient is as large as it may be. A bound of zero is one of the sign, which no effect reaches.
bool is_at_bound(const stability::EffectInfo& library, const Refined& refined) {
  constexpr double kClose = 1e-6;
  const std::vector<stability::Parameter>& linear = refined.candidate.info.linear;
  for (std::size_t c = 0; c < linear.size(); ++c) {
    const stability::Parameter& stated = library.linear[c % library.linear.size()];
    const double close = kClose * (linear[c].upper - linear[c].lower), value = refined.coefficients[c];
    if (close == 0) continue;
    if (stated.upper != 0 && value >= linear[c].upper - close) return true;
    if (stated.lower != 0 && value <= linear[c].lower + close) return true;
  }
  return false;
}

/// Returns the effects that ended at a bound: with a coefficient, or with a shape that did not start there, i.e. that
/// really fit something else. Shapes of effects of neighbours may end anywhere, because nothing else acts where
/// neighbours are.
std::set<std::string> out_of_bounds(const Selected& selected) {
  std::set<std::string> names;
  for (const Refined& refined : selected.refined) {
    const stability::EffectInfo& info = refined.candidate.info;
    if (is_of_library(refined.candidate.name) && !info.remembers &&
        is_at_bound(stability::effect_info(refined.candidate.name), refined))
      names.insert(refined.candidate.name);
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

/// Adds the drag law that replaces named drags as the first formula, and its curve, whose entries stay sorted by share.
void add_drag_law(const ScanSamples& left, Explained& explained) {
  std::optional<DragLaw> law = drag_law(left, {});
  ScanEntry entry = along_velocity(left);
  if (!law || entry.curve.empty()) return;
  std::vector<ScanEntry>& entries = explained.scan.entries;
  const auto place = std::find_if(entries.begin(), entries.end(),
                                  [&](const ScanEntry& other) { return other.share < entry.share; });
  law->formula.entry = static_cast<std::size_t>(place - entries.begin());
  for (Formula& formula : explained.formulas) formula.entry += formula.entry >= law->formula.entry ? 1 : 0;
  entries.insert(place, std::move(entry));
  explained.formulas.insert(explained.formulas.begin(), std::move(law->formula));
}

/// Scans the remainder beside the effects found.
void scan_what_is_left(const Passes& passes, Explained& explained) {
  const ScanSamples left = scan_samples(passes, specs_of(explained.settled.ranking));
  explained.scan = scan(left, passes.jobs);
  explained.formulas = find_formulas(left, explained.scan, kMostFormulas, passes.jobs);
  if (explained.has_drag_law) add_drag_law(left, explained);
}

/// Returns the refined effects in their order.
std::vector<Refined> refined_of(const Settled& settled) {
  std::vector<Refined> result;
  for (const Missing& missing : settled.ranking) {
    const std::vector<Refined>& all = settled.selected.refined;
    const auto found = std::find_if(all.begin(), all.end(), [&](const Refined& effect) {
      return effect.candidate.name == missing.effect;
    });
    if (found == all.end()) return {};
    result.push_back(*found);
  }
  return result;
}

/// Checks `refined` against the setpoints, widens its intervals, and stores its values in `ranking`.
void set_numbers(const Passes& passes, std::vector<Refined>& refined, const Grams& grams,
                 std::vector<Missing>& ranking) {
  const std::vector<std::vector<InstrumentedValue>> checks = instrument(passes, candidates_of(refined));
  widen_by_bias(checks, instrument_with_shapes(passes, refined), refined);
  for (std::size_t i = 0; i < refined.size(); ++i) {
    ranking[i] = with_numbers(passes, refined[i], ranking[i], grams);
    if (!checks.empty()) set_instrument(refined[i], checks[i], ranking[i]);
  }
}

/// Returns the candidates of the registry, and those that curves of the remainder suggest.
std::vector<Candidate> candidates_to_weigh(const Passes& passes, const Coverage& covered) {
  const stability::Model& model = *passes.inputs.model_of(passes.kind);
  std::vector<Candidate> all = all_candidates(model, covered);
  const ScanSamples samples = scan_samples(passes, {});
  const std::vector<Formula> formulas =
      find_formulas(samples, scan(samples, passes.jobs), kMostFormulas, passes.jobs);
  for (Candidate& form : named_forms(formulas, model, covered)) all.push_back(std::move(form));
  for (const std::string& name : stability::effect_names()) {
    const auto is_it = [&](const auto& one) { return one.name == name; };
    if (stability::traits_of(name).hides_its_curve &&
        std::none_of(model.effects.begin(), model.effects.end(), is_it) &&
        std::none_of(all.begin(), all.end(), is_it))
      all.push_back(candidate(name, model, covered));
  }
  return all;
}

/// Returns the effects of `found` with values, intervals and checks, in the order in which they lower the error most.
Selected selected_of(const Passes& passes, const std::vector<Candidate>& candidates,
                     const evidence::Explanations& found) {
  std::vector<Candidate> named;
  for (const evidence::Named& effect : found.effects) named.push_back(effect.candidate);
  Selected result;
  result.grams = block_grams(passes, named);
  for (int i = 0; i < static_cast<int>(named.size()); ++i) result.members.push_back({i, 0});
  result.members = CrossValidation(result.grams).ordered(result.members);
  std::vector<Start> starts;
  for (const Member& member : result.members) {
    const Candidate& one = named[static_cast<std::size_t>(member.candidate)];
    const auto with_grid = std::find_if(candidates.begin(), candidates.end(), [&](const Candidate& other) {
      return other.name == one.name && other.vehicles == one.vehicles;
    });
    starts.push_back({*with_grid, one.thetas[0]});
  }
  result.refined = with_innovations(passes, refine(passes, starts));
  result.checks = instrument(passes, candidates_of(result.refined));
  widen_by_bias(result.checks, instrument_with_shapes(passes, result.refined), result.refined);
  return result;
}

/// Returns the effects of which held-out blocks do not say, with 90 % confidence, that they lower the error.
std::set<std::string> unhelpful(const std::vector<Missing>& ranking) {
  constexpr double kConfirmed_z = 1.28;
  std::set<std::string> names;
  for (const Missing& missing : ranking) {
    if (!(missing.finding.paired_z > kConfirmed_z)) names.insert(missing.effect);
  }
  return names;
}

void set_evidence(const evidence::Explanations& found, std::vector<Missing>& ranking) {
  for (Missing& missing : ranking) {
    const auto named = std::find_if(found.effects.begin(), found.effects.end(), [&](const auto& effect) {
      return effect.candidate.name == missing.effect;
    });
    missing.finding.evidence_bits = named->evidence_bits;
    missing.finding.rivals = named->rivals;
  }
}

/// Returns a load on a string, if part of the weight or a curve is found, and the flights show that it swings.
std::optional<Candidate> swinging_load(const Passes& passes, const Coverage& covered,
                                       const Explained& explained) {
  const std::vector<stability::EffectSpec>& own = passes.inputs.model_of(passes.kind)->effects;
  if (std::any_of(own.begin(), own.end(), [](const auto& spec) { return swings(spec.name); })) return {};
  const auto is_of_weight = [](const std::string& name) { return is_scale(name) || is_push(name); };
  const Settled& settled = explained.settled;
  bool may_be_load =
      explained.has_curves || std::any_of(settled.suspected.begin(), settled.suspected.end(), is_of_weight);
  std::vector<stability::EffectSpec> beside;
  for (const Missing& missing : settled.ranking) {
    if (is_of_weight(missing.effect))
      may_be_load = true;
    else
      beside.insert(beside.end(), missing.specs.begin(), missing.specs.end());
  }
  return may_be_load ? visible_pendulum(passes, covered, beside) : std::nullopt;
}

/// Weighs the candidates, until none that is named is at a bound or of no help to predict held-out blocks.
void settle(const Passes& passes, const std::vector<Candidate>& candidates, Explained& result) {
  evidence::Hypotheses hypotheses = evidence::hypotheses(passes, candidates);
  Settled& settled = result.settled = {};
  std::set<std::string> doubtful;
  do {
    const evidence::Explanations found = evidence::explanations(passes, hypotheses);
    settled.selected = selected_of(passes, candidates, found);
    settled.ranking = ranking_of(passes, settled.selected);
    set_evidence(found, settled.ranking);
    settled.detectable = found.detectable;
    result.has_drag_law = found.has_drag_curve;
    result.has_curves = !found.curves.empty();
    doubtful = out_of_bounds(settled.selected);
    settled.at_bound.insert(doubtful.begin(), doubtful.end());
    doubtful.merge(unhelpful(settled.ranking));
    hypotheses.excluded.insert(doubtful.begin(), doubtful.end());
  } while (!doubtful.empty());
  const auto is_of_scan = [](const auto& entry) {
    return is_formula(entry.effect) || needs_scan(entry.effect);
  };
  settled.detectable.erase(std::remove_if(settled.detectable.begin(), settled.detectable.end(), is_of_scan),
                           settled.detectable.end());
  settled.suspected.assign(hypotheses.excluded.begin(), hypotheses.excluded.end());
}

}  // namespace

Explained explain(const Passes& passes, const Coverage& covered) {
  std::vector<Candidate> candidates = candidates_to_weigh(passes, covered);
  Explained explained;
  settle(passes, candidates, explained);
  if (const auto load = swinging_load(passes, covered, explained)) {
    candidates.push_back(*load);
    settle(passes, candidates, explained);
  }
  explained.settled.rest = remainder(passes, specs_of(explained.settled.ranking));
  scan_what_is_left(passes, explained);
  return explained;
}

std::optional<std::pair<double, double>> fit_to_all(const Passes& all, const Passes& seen,
                                                    Explained& explained) {
  std::vector<Missing>& ranking = explained.settled.ranking;
  std::vector<Refined> refined = refit(all, seen, refined_of(explained.settled));
  if (refined.size() < ranking.size()) return std::nullopt;
  std::vector<Candidate> candidates;
  Members members;
  for (const Refined& effect : refined) {
    members.push_back({static_cast<int>(candidates.size()), 0});
    candidates.push_back(effect.candidate);
  }
  const Grams grams = block_grams(all, std::move(candidates));
  const CrossValidation fits(grams);
  const std::vector<Finding> found = findings(fits, members);
  for (std::size_t i = 0; i < found.size(); ++i) {
    Finding& finding = ranking[i].finding;
    Finding next = found[i];
    next.member = finding.member;
    next.rivals = std::move(finding.rivals);
    next.evidence_bits = finding.evidence_bits;
    next.model_form = std::move(finding.model_form);
    finding = std::move(next);
  }
  if (!refined.empty()) set_numbers(all, refined, grams, ranking);
  return std::make_pair(fits.mean_square({}), fits.mean_square(members));
}

}  // namespace swarmcert::identification
