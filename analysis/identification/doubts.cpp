#include "analysis/identification/doubts.h"

#include <algorithm>
#include <vector>

#include "analysis/identification/closed_loop.h"
#include "stability/effects/registry.h"

namespace swarmcert::identification {

using stability::EffectTraits;
using stability::Family;

bool is_of_library(const std::string& effect) {
  const std::vector<std::string> library = stability::effect_names();
  return std::find(library.begin(), library.end(), effect) != library.end();
}

std::set<std::string> fixed_drags() {
  std::set<std::string> drags;
  for (const std::string& name : stability::effect_names()) {
    if (stability::traits_of(name).drag_exponent > 0) drags.insert(name);
  }
  return drags;
}

std::set<std::string> wakes_without_delay(const Selected& selected) {
  const auto place_of = [&](Family reduces_to) {
    return std::find_if(selected.refined.begin(), selected.refined.end(), [&](const Refined& refined) {
      const EffectTraits& traits = refined.candidate.info.traits;
      return traits.family == Family::kWake && traits.reduces_to == reduces_to;
    });
  };
  const auto delayed = place_of(Family::kWake), at_once = place_of(Family::kNone);
  if (delayed == selected.refined.end()) return {};
  const stability::Parameter& delay = delayed->candidate.info.shape[0];
  const double least_s =
      delayed->shape_intervals.empty() ? delayed->theta[0] : delayed->shape_intervals[0].lower;
  if (std::min(least_s, delayed->theta[0]) <= delay.lower) return {delayed->candidate.name};
  if (at_once == selected.refined.end()) return {};
  const Selection selection(selected.grams);
  const auto loss_without = [&](auto place) {
    return selection.loss_without(selected.members,
                                  static_cast<std::size_t>(place - selected.refined.begin()));
  };
  return {(loss_without(delayed) < loss_without(at_once) ? delayed : at_once)->candidate.name};
}

double taken_N2(const Missing& missing) {
  const Finding& finding = missing.finding;
  return finding.rmse_before_N * finding.rmse_before_N - finding.rmse_after_N * finding.rmse_after_N;
}

bool may_be_part(const Missing& missing, double weight_N) {
  constexpr double kSmall = 0.02;
  if (is_plain_scale(missing.effect) || is_push(missing.effect))
    return taken_N2(missing) < kSmall * weight_N * (kSmall * weight_N);
  const EffectTraits& traits = stability::traits_of(missing.effect);
  return traits.family == Family::kNone && !traits.variables.empty();
}

bool is_doubtful(const Missing& missing, const Remainder& rest, const Scan& scan, double weight_N) {
  constexpr double kMost = 0.5, kOfSameVariable = 0.5, kLittle = 0.1;
  const double taken = taken_N2(missing);
  // Formulas selected beside the effect are part of the remainder again; the effect may be part of what they explain.
  if (rest.ratio > kLoudRatio && taken < kLittle * rest.excess_N2) return true;
  if (rest.flag && may_be_part(missing, weight_N) && taken < rest.excess_N2) return true;
  if (scan.entries.empty() || scan.entries[0].share < kMost) return false;
  const ScanEntry& first = scan.entries[0];
  const double left = first.rmse_before * first.rmse_before - first.rmse_after * first.rmse_after;
  // If one variable explains most of the remainder, thrust and its history react to it.
  if (is_of_library(missing.effect) && is_of_thrust(stability::effect_info(missing.effect)) && taken <= left)
    return true;
  // An effect of this variable that leaves most of the dependence on it has the wrong form.
  return stability::traits_of(missing.effect).varies_with(first.variable) && kOfSameVariable * taken < left;
}

}  // namespace swarmcert::identification
