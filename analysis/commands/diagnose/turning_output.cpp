#include "analysis/commands/diagnose/turning_output.h"

#include <fmt/core.h>

#include "analysis/identification/candidates.h"
#include "analysis/identification/flight_split.h"
#include "analysis/identification/turning_search.h"
#include "stability/effects/registry.h"

namespace swarmcert::analysis {
namespace {

/// @param spec with its value beside all other effects that were found.
Ranked ranked_turning(const identification::TurningStep& step, const stability::EffectSpec& spec,
                      const std::string& kind) {
  Ranked entry;
  entry.effect = spec.name;
  entry.kind = kind;
  entry.parameters = fitted_values(spec.name, spec.parameters, {});
  entry.equivalence_class = stability::effect_info(spec.name).equivalence_class;
  entry.separated_by = stability::effect_info(spec.name).excitation;
  entry.statement =
      fmt::format("body rates half a second ahead are predicted to {:.3g} instead of {:.3g} rad/s",
                  step.found.mean_rad_s(), step.before_rad_s);
  return entry;
}

}  // namespace

void judge_turning(residuals::Inputs inputs, const std::vector<identification::Diagnosis>& forces, int jobs,
                   bool prints, Judgement& judgement) {
  std::vector<Ranked> causes;
  for (std::size_t i = 0; i < inputs.models.size(); ++i)
    inputs.models[i] = identification::with_effects(inputs.models[i], specs_of(forces[i].ranking));
  const identification::Split split = identification::split_flights(inputs);
  for (const stability::Model& model : inputs.models) {
    const std::vector<identification::TurningStep> steps =
        identification::turning_steps(inputs, model.kind, split.fit, split.select, jobs);
    for (std::size_t k = 0; k < steps.size(); ++k) {
      const stability::EffectSpec& spec = steps.back().found.specs[k];
      causes.push_back(ranked_turning(steps[k], spec, model.kind));
      if (!prints) continue;
      fmt::print("  {:<15} {}\n", spec.name, *causes.back().statement);
      print_values(spec.name, "    ", spec.parameters, {});
    }
  }
  judgement.append(std::move(causes));
}

}  // namespace swarmcert::analysis
