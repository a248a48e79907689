#include "analysis/identification/explanation.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "analysis/identification/closed_loop.h"
#include "analysis/identification/doubts.h"
#include "analysis/identification/scan/drag_law.h"
#include "analysis/identification/scan/named_forms.h"
#include "analysis/identification/swinging_load.h"
#include "analysis/identification/thrust_doubts.h"
#include "nn/base/doubles.h"
#include "stability/effects/registry.h"

namespace swarmcert::identification {
namespace {

/// A formula replaces named effects if it leaves less than this fraction of the mean square, which favours names.
constexpr double kClearlyLess = 0.9;

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

/// Selects effects and settles suspects.
/// @param rivals compete with the candidates that are always included
/// @param start effects with which the selection begins
/// @param refuted effects that are not candidates
Settled settle(const Passes& passes, const Coverage& covered, const std::vector<Candidate>& rivals,
               const std::vector<std::string>& start, const std::set<std::string>& refuted = {}) {
  constexpr int kMostRounds = 8;
  std::vector<Candidate> candidates = all_candidates(*passes.inputs.model_of(passes.kind), covered);
  candidates.insert(candidates.end(), rivals.begin(), rivals.end());
  erase(candidates, refuted);
  Settled result;
  result.suspected.assign(refuted.begin(), refuted.end());
  bool doubts_slope = false;
  for (int round = 0; round < kMostRounds; ++round) {
    result.selected =
        doubts_slope ? without_slope(passes, candidates, {}) : select(passes, candidates, start);
    std::set<std::string> doubtful = out_of_bounds(result.selected);
    result.at_bound.insert(doubtful.begin(), doubtful.end());
    doubtful.merge(unconfirmed_loads(result.selected));
    doubtful.merge(wakes_without_delay(result.selected));
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

bool is_ranked(const std::string& name, const Settled& settled) {
  return std::any_of(settled.ranking.begin(), settled.ranking.end(),
                     [&](const Missing& missing) { return missing.effect == name; });
}

/// Returns whether a payload may be missing, i.e. whether part of the weight is.
bool may_be_load(const Settled& settled) {
  const auto is_of_weight = [](const std::string& name) { return is_scale(name) || is_push(name); };
  const auto has = [&](const std::vector<std::string>& names) {
    return std::any_of(names.begin(), names.end(), is_of_weight);
  };
  return has(settled.suspected) || has(settled.selected.contradicted) ||
         std::any_of(settled.ranking.begin(), settled.ranking.end(),
                     [&](const Missing& missing) { return is_of_weight(missing.effect); });
}

/// Replaces a thrust scale by a swinging load if the flights show it.
/// @return the candidate that was used, if any
std::vector<Candidate> name_swinging_load(const Passes& passes, const Coverage& covered, Settled& settled) {
  const stability::Model& model = *passes.inputs.model_of(passes.kind);
  const bool is_in_model = std::any_of(model.effects.begin(), model.effects.end(),
                                       [](const auto& spec) { return swings(spec.name); });
  if (is_in_model || !may_be_load(settled)) return {};
  std::vector<stability::EffectSpec> beside;
  for (const Missing& missing : settled.ranking) {
    if (is_scale(missing.effect) || is_push(missing.effect)) continue;
    beside.insert(beside.end(), missing.specs.begin(), missing.specs.end());
  }
  const std::optional<Candidate> load = visible_pendulum(passes, covered, beside);
  if (!load) return {};
  Settled swinging = settle(passes, covered, {*load}, {load->name});
  if (!is_ranked(load->name, swinging)) return {};
  settled = std::move(swinging);
  return {*load};
}

/// The remainder of the model without any effects found.
struct Nominal {
  ScanSamples samples;
  Scan scan;
};

/// Returns formulas for the remainder of the model, and for that beside the effects found, that may replace effects.
/// @param nominal null if no effect was found
std::vector<Formula> rivals_of_names(const Passes& passes, const Explained& explained,
                                     const Nominal* nominal) {
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
  if (nominal != nullptr) add(find_formulas(nominal->samples, nominal->scan, kOfEach, passes.jobs));
  add(explained.formulas);
  return rivals;
}

FixedDrag fixed_drag(const std::vector<Missing>& ranking) {
  FixedDrag drag;
  for (const Missing& missing : ranking) {
    const double exponent = stability::traits_of(missing.effect).drag_exponent;
    if (exponent == 1) drag.linear_N_s_m = missing.parameters.at(missing.coefficients[0]);
    if (exponent == 2) drag.quadratic_N_s2_m2 = missing.parameters.at(missing.coefficients[0]);
  }
  return drag;
}

/// Returns the drag law for the samples beside the effects of `ranking`, if it clearly explains more than their drags.
std::optional<DragLaw> better_drag_law(const ScanSamples& left, const std::vector<Missing>& ranking) {
  const bool has_drag = std::any_of(ranking.begin(), ranking.end(), [](const Missing& missing) {
    return stability::traits_of(missing.effect).drag_exponent > 0;
  });
  if (!has_drag) return std::nullopt;
  std::optional<DragLaw> law = drag_law(left, fixed_drag(ranking));
  if (law && !(law->mean_square_N2 < kClearlyLess * mean_square_N2(left))) law.reset();
  return law;
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
/// @return the samples of that remainder
ScanSamples scan_what_is_left(const Passes& passes, Explained& explained) {
  ScanSamples left = scan_samples(passes, specs_of(explained.settled.ranking));
  explained.scan = scan(left, passes.jobs);
  explained.formulas = find_formulas(left, explained.scan, kMostFormulas, passes.jobs);
  if (explained.has_drag_law) add_drag_law(left, explained);
  return left;
}

/// Moves effects to the suspects and scans the remainder again.
template <typename IsDropped>
void drop_names(const Passes& passes, Explained& explained, const IsDropped& is_dropped) {
  std::vector<Missing>& ranking = explained.settled.ranking;
  const auto doubtful = std::stable_partition(ranking.begin(), ranking.end(),
                                              [&](const Missing& missing) { return !is_dropped(missing); });
  if (doubtful == ranking.end()) return;
  for (auto it = doubtful; it != ranking.end(); ++it) explained.settled.suspected.push_back(it->effect);
  ranking.erase(doubtful, ranking.end());
  explained.settled.rest = remainder(passes, specs_of(ranking));
  scan_what_is_left(passes, explained);
}

void drop_doubtful_names(const Passes& passes, Explained& explained) {
  const double weight_N = passes.inputs.model_of(passes.kind)->weight_N();
  drop_names(passes, explained, [&](const Missing& missing) {
    return is_doubtful(missing, explained.settled.rest, explained.scan, weight_N);
  });
}

/// Returns whether a lag or delay removes little and may be spurious: its interval reaches its lower bound; or it was
/// found beside an effect or formula without which the remainder, to which the thrust reacts, dominates; or it removes
/// no more than such a reaction leaves.
/// @param kept times of lags without the reaction of the thrust, relative to those by least squares
bool may_be_no_lag(const Missing& missing, const Remainder& rest, const std::map<std::string, double>& kept) {
  constexpr double kLittle = 0.1;  // of the mean square, or of what exceeds the noise
  if (!is_of_library(missing.effect)) return false;
  const stability::EffectInfo& info = stability::effect_info(missing.effect);
  const double before = missing.finding.rmse_before_N;
  if (!info.remembers || info.shape.empty()) return false;
  // Thrust that follows a vibration may remove much of it. What a short lag removes is proportional to its time.
  const auto time = kept.find(missing.effect);
  const double share = rest.line.is_found() && time != kept.end() ? std::min(time->second, 1.0) : 1;
  const double taken = share * taken_N2(missing);
  if (taken >= kLittle * before * before) return false;
  if (rest.ratio > kLoudRatio || (rest.flag && taken < kLittle * rest.excess_N2)) return true;
  const auto interval = missing.intervals.find(info.shape[0].name);
  return interval != missing.intervals.end() && interval->second.lower <= info.shape[0].lower;
}

/// Returns whether a thrust scale halves the error. If thrust hardly varies, many formulas are equivalent to it.
bool has_plain_scale(const std::vector<Missing>& ranking) {
  constexpr double kHalf = 0.5;
  return std::any_of(ranking.begin(), ranking.end(), [](const Missing& missing) {
    return is_scale(missing.effect) && missing.finding.rmse_after_N <= kHalf * missing.finding.rmse_before_N;
  });
}

/// The contribution of a battery vanishes when the battery is full.
bool is_only_thrust_ratio(const std::vector<Missing>& ranking) {
  return std::all_of(ranking.begin(), ranking.end(), [](const Missing& missing) {
    return !is_scale(missing.effect) || is_plain_scale(missing.effect);
  });
}

/// A thrust scale acts whenever there is thrust. A force of one sign over a variable that explains most of the
/// remainder, and that vanishes over some range, for example at rest, is therefore something else.
bool vanishes_somewhere(const Nominal& nominal) {
  constexpr double kMost = 0.5, kNothing = 0.15;  // of the variance; of the mean
  return std::any_of(nominal.scan.entries.begin(), nominal.scan.entries.end(), [&](const ScanEntry& entry) {
    if (entry.share < kMost || entry.curve.empty() || entry.axis != "z") return false;
    const double mean = nominal.samples.residual.col(entry.column).mean();
    double least = kInfinity, width = 0;
    for (const CurvePoint& point : entry.curve) {
      const double share = point.value / mean;
      if (share >= least) continue;
      least = share;
      width = (point.interval.upper - point.interval.lower) / std::abs(mean);
    }
    return std::abs(least) < kNothing && width < 2 * kNothing;
  });
}

/// Returns whether setpoints deny each thrust scale that `by_names` has and `by_formulas` has not: beside the formulas,
/// most of it is surely not there. Thrust that hardly varies denies nothing, because the formulas may have an offset.
bool deny_scales(const Passes& passes, const Settled& by_names, const Settled& by_formulas) {
  constexpr double kMost = 0.5, kSurely = 2;  // of the scale; half-widths of the 90 % interval
  const auto is_in = [&](const std::string& name) {
    return std::any_of(by_formulas.selected.refined.begin(), by_formulas.selected.refined.end(),
                       [&](const Refined& effect) { return effect.candidate.name == name; });
  };
  std::vector<Refined> lost;
  for (const Refined& effect : by_names.selected.refined) {
    if (is_scale(effect.candidate.name) && !is_in(effect.candidate.name)) lost.push_back(effect);
  }
  std::vector<Refined> together = by_formulas.selected.refined;
  together.insert(together.end(), lost.begin(), lost.end());
  const std::vector<std::vector<InstrumentedValue>> checks = instrument(passes, candidates_of(together));
  if (lost.empty() || checks.empty()) return false;
  for (std::size_t i = 0; i < lost.size(); ++i) {
    const InstrumentedValue& value = checks[checks.size() - lost.size() + i][0];
    const double half = (value.interval.upper - value.interval.lower) / 2, named = lost[i].coefficients[0];
    if (!(std::abs(value.instrument) + kSurely * half < kMost * std::abs(named))) return false;
  }
  return true;
}

/// Like settle(), without formulas that merely compensate an overestimated thrust scale.
Settled settle_with_formulas(const Passes& passes, const Coverage& covered, std::vector<Candidate> rivals,
                             const std::vector<std::string>& names,
                             const std::set<std::string>& refuted = {}) {
  constexpr int kMostRounds = 4;
  Settled result = settle(passes, covered, rivals, names, refuted);
  for (int round = 1; round < kMostRounds; ++round) {
    const std::set<std::string> substitutes = substitutes_of_scales(result.selected);
    if (substitutes.empty()) break;
    erase(rivals, substitutes);
    result = settle(passes, covered, rivals, names, refuted);
  }
  return result;
}

/// Returns whether the force of an effect is a curve over this variable of the scan, or shifts one that is found beside
/// it, as a plain form does.
bool is_curve_over(const std::string& variable, const std::string& effect,
                   const std::vector<Missing>& ranking) {
  const stability::EffectTraits& traits = stability::traits_of(effect);
  const auto is_shifted = [&](const Missing& other) {
    const stability::EffectTraits& varying = stability::traits_of(other.effect);
    return traits.is_plain(varying.family) && varying.reduces_to == traits.family &&
           varying.varies_with(variable);
  };
  return traits.varies_with(variable) || (traits.family != stability::Family::kNone &&
                                          std::any_of(ranking.begin(), ranking.end(), is_shifted));
}

/// Returns effects that may be part of something else and after which the remainder still varies with their own
/// variable by at least a tenth of what they remove: their form does not match the flights. Relative to the whole
/// error, including noise, that may be little.
std::set<std::string> refuted_names(const Explained& explained, double weight_N) {
  constexpr double kOfTaken = 0.1;
  const std::vector<Missing>& ranking = explained.settled.ranking;
  std::set<std::string> names;
  for (const Missing& missing : ranking) {
    const bool is_late = stability::traits_of(missing.effect).family == stability::Family::kLate;
    if (!may_be_part(missing, weight_N) && !is_late) continue;
    for (const ScanEntry& entry : explained.scan.entries) {
      const double left = entry.rmse_before * entry.rmse_before - entry.rmse_after * entry.rmse_after;
      if (is_curve_over(entry.variable, missing.effect, ranking) && left > kOfTaken * taken_N2(missing))
        names.insert(missing.effect);
    }
  }
  return names;
}

/// Adds effects that hide their curve to `rivals` if anything is left.
void add_hidden(const Explained& explained, const stability::Model& model, const Coverage& covered,
                std::vector<Candidate>& rivals) {
  if (!explained.settled.rest.flag) return;
  for (const std::string& name : stability::effect_names()) {
    const auto is_it = [&](const auto& one) { return one.name == name; };
    if (stability::traits_of(name).hides_its_curve &&
        std::none_of(model.effects.begin(), model.effects.end(), is_it) &&
        std::none_of(rivals.begin(), rivals.end(), is_it))
      rivals.push_back(candidate(name, model, covered));
  }
}

/// Returns a selection with a drag law in place of drags of fixed exponents, if held-out blocks clearly prefer it.
/// @param rivals candidates beside it
std::optional<Settled> settle_with_drag_law(const Passes& passes, const Coverage& covered, const DragLaw& law,
                                            std::vector<Candidate> rivals, double left_by_names) {
  rivals.push_back(candidate_of(law.formula, *passes.inputs.model_of(passes.kind)));
  Settled other = settle_with_formulas(passes, covered, std::move(rivals), {kDragLaw}, fixed_drags());
  const double left = Selection(other.selected.grams).mean_square(other.selected.members);
  if (!is_ranked(kDragLaw, other) || !(left < kClearlyLess * left_by_names)) return std::nullopt;
  return other;
}

/// Accepts an effect only if it explains about as much as the best formula would in its place. If formulas win, the
/// selection is repeated with them as candidates, and they become part of the remainder. Effects that only formulas
/// suggest take part as well.
Explained explain_by_formulas(const Passes& passes, const Coverage& covered) {
  constexpr double kMuchLess = 0.7;  // of the mean square
  Explained result;
  result.settled = settle(passes, covered, {}, {});
  const std::vector<Candidate> loads = name_swinging_load(passes, covered, result.settled);
  const std::optional<DragLaw> law =
      better_drag_law(scan_what_is_left(passes, result), result.settled.ranking);
  std::optional<Nominal> nominal;
  if (!result.settled.ranking.empty()) {
    nominal.emplace(Nominal{scan_samples(passes, {}), {}});
    nominal->scan = scan(nominal->samples, passes.jobs);
  }
  const std::vector<Formula> formulas = rivals_of_names(passes, result, nominal ? &*nominal : nullptr);
  const stability::Model& model = *passes.inputs.model_of(passes.kind);
  std::vector<Candidate> rivals = named_forms(formulas, model, covered);
  add_hidden(result, model, covered, rivals);
  const bool has_rivals = !rivals.empty() || law;
  if (!has_rivals && (formulas.empty() || result.settled.ranking.empty())) return result;
  for (const Formula& formula : formulas) rivals.push_back(candidate_of(formula, model));
  rivals.insert(rivals.end(), loads.begin(), loads.end());
  const Selection by_names(result.settled.selected.grams);
  const double left_by_names = by_names.mean_square(result.settled.selected.members);
  const auto accept = [&](Settled&& other) {
    other.ranking.erase(std::stable_partition(other.ranking.begin(), other.ranking.end(), is_named),
                        other.ranking.end());
    other.rest = remainder(passes, specs_of(other.ranking));
    result.settled = std::move(other);
    scan_what_is_left(passes, result);
    return result;
  };
  const std::set<std::string> refuted = refuted_names(result, model.weight_N());
  if (!refuted.empty()) {
    Settled other = settle_with_formulas(passes, covered, rivals, {}, refuted);
    if (Selection(other.selected.grams).mean_square(other.selected.members) < left_by_names)
      return accept(std::move(other));
  }
  if (law) {
    if (std::optional<Settled> other = settle_with_drag_law(passes, covered, *law, rivals, left_by_names)) {
      result.has_drag_law = true;
      return accept(std::move(*other));
    }
  }
  std::vector<std::string> names;
  for (const Missing& missing : result.settled.ranking) names.push_back(missing.effect);
  Settled again = settle_with_formulas(passes, covered, rivals, names);
  const auto is_known = [](const Missing& missing) {
    return is_named(missing) && !needs_scan(missing.effect);
  };
  if (std::all_of(again.ranking.begin(), again.ranking.end(), is_known)) return result;
  const double left = Selection(again.selected.grams).mean_square(again.selected.members);
  if (!(left < kClearlyLess * left_by_names)) return result;
  const bool loses_scale = has_plain_scale(result.settled.ranking) && !has_plain_scale(again.ranking);
  if (!loses_scale) return accept(std::move(again));
  // What no model can explain is not counted, else noise would decide.
  const double floor = std::isfinite(again.rest.floor_N2) ? again.rest.floor_N2 : 0;
  const bool is_much_less = left - floor < kMuchLess * (left_by_names - floor);
  const bool is_other = is_only_thrust_ratio(result.settled.ranking) || is_much_less;
  const bool is_denied =
      is_other && (vanishes_somewhere(*nominal) || deny_scales(passes, result.settled, again));
  return is_denied ? accept(std::move(again)) : result;
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

/// Fits lags and delays to the innovations of the residual, with the other values fitted and checked beside them as in
/// fit_effects(). If a time changes, the remainder is scanned again.
/// @return the new times of lags and delays divided by the old ones
std::map<std::string, double> correct_memories(const Passes& passes, Explained& explained) {
  constexpr double kMoved = 0.1;
  std::vector<Missing>& ranking = explained.settled.ranking;
  const std::vector<Refined> refined = refined_of(explained.settled);
  std::vector<Refined> corrected = with_innovations(passes, refined);
  std::map<std::string, double> kept;
  bool is_other = false, has_moved = false;
  for (std::size_t i = 0; i < corrected.size(); ++i) {
    if (!corrected[i].candidate.info.remembers) continue;
    if (refined[i].theta[0] > 0)
      kept[corrected[i].candidate.name] = corrected[i].theta[0] / refined[i].theta[0];
    const double moved = std::abs(corrected[i].theta[0] - refined[i].theta[0]);
    is_other = is_other || moved > 0;
    has_moved = has_moved || moved > kMoved * refined[i].theta[0];
  }
  if (!is_other) return kept;  // no lag, or white noise: values and intervals stay
  set_numbers(passes, corrected, explained.settled.selected.grams, ranking);
  for (const Refined& effect : corrected) {
    for (Refined& known : explained.settled.selected.refined) {
      if (known.candidate.name == effect.candidate.name) known = effect;
    }
  }
  if (!has_moved) return kept;
  explained.settled.rest = remainder(passes, specs_of(ranking));
  scan_what_is_left(passes, explained);
  return kept;
}

}  // namespace

Explained explain(const Passes& passes, const Coverage& covered) {
  Explained explained = explain_by_formulas(passes, covered);
  drop_doubtful_names(passes, explained);
  if (is_mean_of_a_force(passes, explained.settled.ranking, explained.formulas))
    drop_names(passes, explained, [](const Missing& missing) { return is_plain_scale(missing.effect); });
  const std::map<std::string, double> kept = correct_memories(passes, explained);
  drop_names(passes, explained,
             [&](const Missing& missing) { return may_be_no_lag(missing, explained.settled.rest, kept); });
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
  const Selection selection(grams);
  const std::vector<Finding> found = findings(selection, members);
  for (std::size_t i = 0; i < found.size(); ++i) {
    Finding& finding = ranking[i].finding;
    Finding next = found[i];
    next.member = finding.member;
    next.rivals = std::move(finding.rivals);
    next.model_form = std::move(finding.model_form);
    finding = std::move(next);
  }
  if (!refined.empty()) set_numbers(all, refined, grams, ranking);
  return std::make_pair(selection.mean_square({}), selection.mean_square(members));
}

}  // namespace swarmcert::identification
