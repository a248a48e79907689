#include "analysis/identification/missing.h"

#include <algorithm>
#include <set>

#include "stability/effects/registry.h"

namespace swarmcert::identification {
namespace {

Missing missing_of(const Passes& passes, const Refined& known, Finding finding, const Grams& grams) {
  const Refined refined = widened_by_step(passes, known);
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
    if (interval.lower < interval.upper) missing.intervals[name] = interval;
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

}  // namespace

Missing with_numbers(const Passes& passes, const Refined& refined, const Missing& missing,
                     const Grams& grams) {
  Missing result = missing_of(passes, refined, missing.finding, grams);
  result.instrument = missing.instrument;
  return result;
}

void set_instrument(const Refined& refined, const std::vector<InstrumentedValue>& checks, Missing& missing) {
  const bool has_free_shape =
      std::any_of(refined.shape_intervals.begin(), refined.shape_intervals.end(),
                  [](const Interval& interval) { return interval.lower < interval.upper; });
  if (!has_free_shape) missing.instrument = checks;
}

std::vector<Missing> ranking_of(const Passes& passes, const Selected& selected) {
  std::vector<Finding> known = findings(CrossValidation(selected.grams), selected.members);
  std::vector<Missing> ranking;
  for (std::size_t i = 0; i < known.size(); ++i) {
    ranking.push_back(missing_of(passes, selected.refined[i], std::move(known[i]), selected.grams));
    if (!selected.checks.empty()) set_instrument(selected.refined[i], selected.checks[i], ranking.back());
  }
  return ranking;
}

std::vector<stability::EffectSpec> specs_of(const std::vector<Missing>& missing) {
  std::vector<stability::EffectSpec> specs;
  for (const Missing& m : missing) specs.insert(specs.end(), m.specs.begin(), m.specs.end());
  return specs;
}

}  // namespace swarmcert::identification
