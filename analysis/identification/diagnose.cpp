#include "analysis/identification/diagnose.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "analysis/residuals/comparison.h"
#include "stability/effects/registry.h"

namespace swarmcert::identification {
namespace {

constexpr double kFlagRatio = 3;  ///< correct models of 54 simulations stayed below 2.4
constexpr std::size_t kManyRecords = 400'000;

/// The candidate of `member` alone, with thetas around its own: one number changed at a time.
Candidate around(const Candidate& candidate, int theta, double step) {
  Candidate result = candidate;
  const std::vector<double> centre = candidate.thetas[static_cast<std::size_t>(theta)];
  result.thetas = {centre};
  // A lag is a lag: once found, its gain is 1 and its time takes what the free gain had taken.
  if (result.info.remembers) result.info.linear[0].lower = result.info.linear[0].upper = 1;
  for (std::size_t i = 0; i < centre.size(); ++i) {
    const stability::Parameter& parameter = candidate.info.shape[i];
    const bool varies = !parameter.grid.empty() ||
                        std::any_of(candidate.thetas.begin(), candidate.thetas.end(),
                                    [&](const std::vector<double>& other) { return other[i] != centre[i]; });
    if (!varies || centre[i] == 0) continue;
    for (const double factor : {1 / (1 + step), 1 + step}) {
      std::vector<double> moved = centre;
      moved[i] = std::clamp(centre[i] * factor, parameter.lower, parameter.upper);
      result.thetas.push_back(moved);
    }
  }
  return result;
}

/// Moves the thetas off the grid: a pattern search with shrinking steps.
Grams refined(const residuals::Inputs& inputs, const std::string& kind, Grams grams,
              std::vector<Member>& members, const std::vector<int>& which, std::size_t records, int jobs,
              const residuals::Progress& progress) {
  const std::vector<double> steps =
      records > kManyRecords ? std::vector<double>{0.15} : std::vector<double>{0.25, 0.12, 0.12, 0.06, 0.03};
  for (const double step : steps) {
    std::vector<Candidate> candidates;
    bool any = false;
    for (const Member& m : members) {
      candidates.push_back(around(grams.candidates[static_cast<std::size_t>(m.candidate)], m.theta, step));
      any = any || candidates.back().thetas.size() > 1;
    }
    if (!any) break;
    grams = block_grams(inputs, kind, candidates, which, jobs, progress);
    const Selection selection(grams);
    for (std::size_t i = 0; i < members.size(); ++i) members[i] = {static_cast<int>(i), 0};
    for (int round = 0; round < 2; ++round) {
      for (std::size_t i = 0; i < members.size(); ++i) {
        std::vector<Member> rest = members;
        rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(i));
        members[i] = selection.best_theta(rest, static_cast<int>(i));
      }
    }
  }
  return grams;
}

stability::EffectSpec spec_of(const Candidate& candidate, const Member& member, const Finding& finding) {
  stability::EffectSpec spec = candidate.spec;
  for (std::size_t c = 0; c < finding.coefficients.size(); ++c) {
    const stability::Parameter& p = candidate.info.linear[c];
    spec.parameters[p.name] = finding.coefficients[c];
    spec.fit.interval[p.name] = finding.intervals[c];
  }
  for (std::size_t i = 0; i < candidate.info.shape.size(); ++i)
    spec.parameters[candidate.info.shape[i].name] =
        candidate.thetas[static_cast<std::size_t>(member.theta)][i];
  return spec;
}

std::vector<Missing> missing_effects(const residuals::Inputs& inputs, const std::string& kind,
                                     const Grams& grams, const std::vector<Member>& members) {
  std::vector<Missing> result;
  std::set<int> flights;
  for (const Block& block : grams.blocks) flights.insert(block.flight);
  for (Finding& finding : Selection(grams).findings(members)) {
    const Candidate& candidate = grams.candidates[static_cast<std::size_t>(finding.member.candidate)];
    Missing missing;
    missing.effect = candidate.name;
    missing.equivalence_class = candidate.info.equivalence_class;
    missing.kind = kind;
    missing.excitation = candidate.info.excitation;
    missing.spec = spec_of(candidate, finding.member, finding);
    for (const int flight : flights)
      missing.spec.fit.flights.push_back(inputs.found.flights[static_cast<std::size_t>(flight)].name);
    missing.flights = static_cast<int>(flights.size());
    missing.finding = std::move(finding);
    result.push_back(std::move(missing));
  }
  return result;
}

Remainder remainder_of(residuals::Inputs inputs, const std::string& kind, const std::vector<Missing>& ranking,
                       const std::vector<int>& which, int jobs) {
  std::vector<stability::EffectSpec> specs;
  for (const Missing& missing : ranking) specs.push_back(missing.spec);
  inputs.models = {with_effects(*inputs.model_of(kind), specs)};
  std::vector<residuals::FlightFiles> flights;
  for (const int i : which) flights.push_back(inputs.found.flights[static_cast<std::size_t>(i)]);
  inputs.found.flights = flights;
  const residuals::Comparison left = residuals::compare(inputs, jobs, [](int, int) {});
  Remainder result;
  for (int axis = 0; axis < 3; ++axis) {
    const double ratio = left.overall.low_band_to_floor[axis];
    if (std::isfinite(ratio)) result.ratio = std::max(result.ratio, ratio);
  }
  result.flag = result.ratio > kFlagRatio;
  if (!result.flag) return result;
  std::array<double, residuals::kNumVariables> shares{};
  for (const residuals::RegionErrors& region : left.regions)
    shares[static_cast<std::size_t>(region.variable)] += region.share;
  for (int rank = 0; rank < residuals::kNumVariables; ++rank) {
    const auto largest = std::max_element(shares.begin(), shares.end());
    if (*largest < 0.02) break;
    result.depends_on.emplace_back(residuals::variable_name(static_cast<int>(largest - shares.begin())));
    *largest = 0;
  }
  return result;
}

}  // namespace

std::vector<int> every_flight(const residuals::Inputs& inputs) {
  std::vector<int> all;
  for (std::size_t i = 0; i < inputs.found.flights.size(); ++i) all.push_back(static_cast<int>(i));
  return all;
}

stability::Model with_effects(const stability::Model& model,
                              const std::vector<stability::EffectSpec>& specs) {
  stability::Model result = model;
  for (const stability::EffectSpec& spec : specs) {
    const stability::EffectInfo& info = stability::effect_info(spec.name);
    const auto known = std::find_if(result.effects.begin(), result.effects.end(),
                                    [&](const stability::EffectSpec& e) { return e.name == spec.name; });
    if (known == result.effects.end()) {
      result.effects.push_back(spec);
      continue;
    }
    // candidate() kept the shape: c1 X + c2 X = (c1 + c2) X; the intervals are those of the addition.
    const stability::EffectValues values = stability::effect_values(info, *known);
    for (std::size_t c = 0; c < info.linear.size(); ++c) {
      const std::string& name = info.linear[c].name;
      known->parameters[name] = values.linear[c] + spec.parameters.at(name);
      const auto& [lower, upper] = spec.fit.interval.at(name);
      known->fit.interval[name] = {values.linear[c] + lower, values.linear[c] + upper};
    }
    known->fit.flights = spec.fit.flights;
    known->fit.note = spec.fit.note;
  }
  return result;
}

Diagnosis diagnose(const residuals::Inputs& inputs, const std::string& kind, const std::vector<int>& which,
                   int jobs, const residuals::Progress& progress) {
  Diagnosis result;
  result.kind = kind;
  const Coverage covered = coverage(inputs, kind, which, jobs);
  const Grams grams =
      block_grams(inputs, kind, all_candidates(*inputs.model_of(kind), covered), which, jobs, progress);
  const Selection selection(grams);
  result.records = covered.records;
  result.blocks = grams.blocks.size();
  result.inconclusive = !selection.is_sound();
  if (result.inconclusive) return result;
  std::vector<Member> members = selection.select();
  result.rmse_before_N = std::sqrt(selection.mean_square({}));
  result.detectable = selection.detectable(members);
  const std::vector<Finding> on_grid = selection.findings(members);
  Grams fine = grams;
  if (!members.empty()) fine = refined(inputs, kind, grams, members, which, covered.records, jobs, progress);
  result.ranking = missing_effects(inputs, kind, fine, members);
  // Rivals come from the grid of all candidates: the refined one has no others.
  for (std::size_t i = 0; i < result.ranking.size(); ++i) {
    result.ranking[i].finding.confounded_with = on_grid[i].confounded_with;
    result.ranking[i].finding.model_form = on_grid[i].model_form;
  }
  result.rmse_after_N =
      result.ranking.empty() ? result.rmse_before_N : result.ranking.back().finding.rmse_after_N;
  result.remainder = remainder_of(inputs, kind, result.ranking, which, jobs);
  return result;
}

std::vector<Missing> fit_effects(const residuals::Inputs& inputs, const std::string& kind,
                                 const std::vector<std::string>& names, const std::vector<int>& which,
                                 int jobs, const residuals::Progress& progress) {
  const Coverage covered = coverage(inputs, kind, which, jobs);
  std::vector<Candidate> candidates;
  for (const std::string& name : names)
    candidates.push_back(candidate(name, *inputs.model_of(kind), covered));
  Grams grams = block_grams(inputs, kind, candidates, which, jobs, progress);
  std::vector<Member> members;
  {
    const Selection selection(grams);
    for (int round = 0; round < 3; ++round) {
      for (std::size_t i = 0; i < names.size(); ++i) {
        std::vector<Member> rest = members;
        if (round > 0) rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(i));
        const Member best = selection.best_theta(rest, static_cast<int>(i));
        if (round == 0)
          members.push_back(best);
        else
          members[i] = best;
      }
    }
  }
  grams = refined(inputs, kind, std::move(grams), members, which, covered.records, jobs, progress);
  return missing_effects(inputs, kind, grams, members);
}

}  // namespace swarmcert::identification
