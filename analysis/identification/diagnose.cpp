#include "analysis/identification/diagnose.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <optional>
#include <set>

#include "analysis/identification/balance/torque_balance.h"
#include "analysis/identification/rotors/lone_rotor.h"
#include "analysis/identification/scan/named_forms.h"
#include "analysis/identification/selected.h"
#include "analysis/identification/swinging_load.h"
#include "nn/base/doubles.h"
#include "stability/effects/registry.h"

namespace swarmcert::identification {
namespace {

/// @param found all effects and formulas of the verdict; the scale and a constant force are fitted beside them, whether
/// the selection chose these or not
ThrustScale thrust_scale(const Passes& passes, const Coverage& covered, const std::vector<Refined>& found) {
  const stability::Model& model = *passes.inputs.model_of(passes.kind);
  std::vector<Candidate> others = candidates_of(found);
  const bool each = std::any_of(others.begin(), others.end(),
                                [](const Candidate& effect) { return effect.name == kVehicleOffset; });
  const std::string push = each ? kVehicleOffset : stability::plain_effect(stability::Family::kPush);
  std::vector<Candidate> effects = {
      candidate(stability::plain_effect(stability::Family::kThrustScale), model, covered),
      candidate(push, model, covered)};
  for (Candidate& effect : others) {
    if (effect.name != effects[0].name && effect.name != effects[1].name)
      effects.push_back(std::move(effect));
  }
  const auto checks = instrument(passes, effects);
  ThrustScale scale;
  if (checks.empty()) return scale;
  scale.is_known = true;
  scale.value = checks[0][0];
  // The model's own ratio is included.
  const double own = own_thrust_ratio(model);
  scale.value.least_squares += own;
  scale.value.instrument += own;
  scale.value.interval = {scale.value.interval.lower + own, scale.value.interval.upper + own};
  return scale;
}

/// Returns the effects found in the mean torques, unless a single rotor may be the cause, which the scan decides.
std::vector<stability::EffectSpec> named_balances(const Passes& passes) {
  std::vector<stability::EffectSpec> specs;
  const residuals::Inputs inputs = inputs_with(passes, {});
  for (const TorqueBalance& balance : torque_balances(inputs, passes.kind, passes.jobs)) {
    const auto& rivals = balance.rivals;
    if (balance.is_named() && std::find(rivals.begin(), rivals.end(), rotor_effect()) == rivals.end())
      specs.push_back(spec_of(balance, balance.effect));
  }
  return specs;
}

/// Scans the remainder of torques and rotors after the effects found.
void scan_balance(const Passes& passes, Diagnosis& result) {
  std::vector<stability::EffectSpec> specs = specs_of(result.ranking);
  for (stability::EffectSpec& spec : named_balances(passes)) specs.push_back(std::move(spec));
  // One hour. Longer data add little and take as long as the force.
  constexpr Eigen::Index kMostOfBalance = 40'000;
  const ScanSamples left = thinned(scan_samples(passes, specs, ScanQuantity::kBalance), kMostOfBalance);
  result.balance = scan(left, passes.jobs);
  result.balance_formulas = find_formulas(left, result.balance, kMostFormulas, passes.jobs);
}

/// Returns candidate(), started at the place found by a scan of the remainder beside `others` if the effect requires
/// one; for a pendulum, with the best length.
Candidate candidate_to_fit(const Passes& passes, const std::string& name, const Coverage& covered,
                           const std::vector<stability::EffectSpec>& others) {
  const stability::Model& model = *passes.inputs.model_of(passes.kind);
  Candidate result = candidate(name, model, covered);
  if (swings(name) && result.thetas.size() > 1) return best_pendulum(passes, covered, others);
  if (!needs_scan(name)) return result;
  const ScanSamples samples = scan_samples(passes, others);
  const std::vector<Formula> formulas =
      find_formulas(samples, scan(samples, passes.jobs), kMostFormulas, passes.jobs);
  for (Candidate& found : named_forms(formulas, model, covered)) {
    if (found.name == name) return std::move(found);
  }
  return result;
}

/// Returns `inputs` restricted to vehicles of `kind`, with their tracks kept between passes: complete, or excerpts of
/// about `most` of their blocks.
residuals::Inputs kept_tracks(const residuals::Inputs& inputs, const std::string& kind, std::size_t blocks,
                              std::size_t most) {
  residuals::Inputs result = inputs;
  result.models = {*inputs.model_of(kind)};
  const double share = blocks > most ? static_cast<double>(most) / static_cast<double>(blocks) : 1;
  result.tracks = std::make_shared<residuals::TrackStore>(share);
  return result;
}

}  // namespace

std::vector<int> every_flight(const residuals::Inputs& inputs) {
  std::vector<int> all;
  for (std::size_t i = 0; i < inputs.found.flights.size(); ++i) all.push_back(static_cast<int>(i));
  return all;
}

Diagnosis diagnose(const residuals::Inputs& inputs, const std::string& kind, const std::vector<int>& which,
                   int jobs, const residuals::Progress& progress, std::size_t most_searched) {
  Diagnosis result;
  result.kind = kind;
  const Coverage covered = coverage(inputs, kind, which, jobs);
  result.records = covered.records;
  result.flights = static_cast<int>(which.size());
  result.blocks = covered.blocks;
  result.has_set_points = covered.has_set_points;
  result.too_poor = covered.too_poor();
  result.problems = covered.problems;
  if (!result.too_poor.empty()) return result;
  const residuals::Inputs searched = kept_tracks(inputs, kind, covered.blocks, most_searched);
  const bool is_excerpt = covered.blocks > most_searched;
  const Coverage seen = is_excerpt ? coverage(searched, kind, which, jobs) : covered;
  result.searched_blocks = seen.blocks;
  const Passes passes = {
      searched, kind, which, seen.records, jobs, progress, std::make_shared<KnownTracks>(which.size())};
  Explained explained = explain(passes, seen);
  const residuals::Inputs whole = kept_tracks(inputs, kind, covered.blocks, covered.blocks);
  const Passes all = is_excerpt ? Passes{whole, kind, which, covered.records, jobs, progress} : passes;
  Settled& settled = explained.settled;
  const Selected& selected = settled.selected;
  const CrossValidation fits(selected.grams);
  result.suspected = std::move(settled.suspected);
  for (const std::string& name : result.suspected) {
    if (settled.at_bound.count(name) == 1) result.at_bound.push_back(name);
  }
  result.rmse_before_N = std::sqrt(fits.mean_square({}));
  Members named;
  for (const Member& member : selected.members) {
    if (!is_formula(fits.candidate(member).name)) named.push_back(member);
  }
  result.rmse_after_N = std::sqrt(fits.mean_square(named));
  result.detectable = std::move(settled.detectable);
  if (is_excerpt) {
    if (const auto squares = fit_to_all(all, passes, explained)) {
      result.rmse_before_N = std::sqrt(squares->first);
      result.rmse_after_N = std::sqrt(squares->second);
    }
  }
  result.ranking = std::move(settled.ranking);
  result.thrust_scale = thrust_scale(all, covered, selected.refined);
  result.remainder = std::move(settled.rest);
  result.scan = std::move(explained.scan);
  result.formulas = std::move(explained.formulas);
  // A force that nothing explains may follow the set points, and then the instrument's interval does not hold.
  if (result.remainder.stands_out() || !result.scan.entries.empty()) result.thrust_scale.is_known = false;
  scan_balance(passes, result);
  return result;
}

std::vector<Missing> missing_effects(const residuals::Inputs& inputs, const std::string& kind,
                                     const std::vector<int>& which, int jobs,
                                     const residuals::Progress& progress) {
  std::vector<Missing> ranking = diagnose(inputs, kind, which, jobs, progress).ranking;
  name_lone_rotor(inputs, kind, which, jobs, ranking);
  return ranking;
}

std::vector<Missing> fit_effects(const residuals::Inputs& inputs, const std::string& kind,
                                 const std::vector<std::string>& names, const std::vector<int>& which,
                                 int jobs, const residuals::Progress& progress) {
  const Coverage covered = coverage(inputs, kind, which, jobs);
  const Passes passes = {inputs, kind, which, covered.records, jobs, progress};
  std::vector<Candidate> candidates;
  std::vector<std::string> others;
  std::remove_copy_if(names.begin(), names.end(), std::back_inserter(others),
                      [](const std::string& name) { return needs_scan(name) || swings(name); });
  std::vector<stability::EffectSpec> beside;
  if (others.size() < names.size() && !others.empty())
    beside = specs_of(fit_effects(inputs, kind, others, which, jobs, progress));
  for (const std::string& name : names) candidates.push_back(candidate_to_fit(passes, name, covered, beside));
  Selected selected;
  selected.grams = block_grams(passes, candidates);
  const CrossValidation fits(selected.grams);
  for (int round = 0; round < 3; ++round) {
    for (std::size_t i = 0; i < names.size(); ++i) {
      const Members rest = round == 0 ? selected.members : without(selected.members, i);
      const Member best = fits.best_theta(rest, static_cast<int>(i));
      if (round == 0)
        selected.members.push_back(best);
      else
        selected.members[i] = best;
    }
  }
  std::vector<Start> starts;
  for (const Member& member : selected.members) {
    const Candidate& candidate = fits.candidate(member);
    starts.push_back({candidate, candidate.thetas[static_cast<std::size_t>(member.theta)]});
  }
  selected.refined = with_innovations(passes, refine(passes, starts));
  selected.checks = instrument(passes, candidates_of(selected.refined));
  widen_by_bias(selected.checks, instrument_with_shapes(passes, selected.refined), selected.refined);
  return ranking_of(passes, selected);
}

}  // namespace swarmcert::identification
