#include "analysis/commands/diagnose/turning_output.h"

#include <fmt/core.h>

#include "analysis/identification/candidates.h"
#include "analysis/identification/flight_split.h"
#include "analysis/identification/turning_search.h"
#include "stability/effects/registry.h"

namespace swarmcert::analysis {
namespace {

Ranked ranked_turning(const identification::TurningStep& step, const std::string& kind) {
  const stability::EffectSpec& spec = step.found.specs.back();
  Ranked entry;
  entry.effect = step.found.name;
  entry.kind = kind;
  entry.parameters = fitted_values(entry.effect, spec.parameters, {});
  entry.equivalence_class = stability::effect_info(entry.effect).equivalence_class;
  entry.separated_by = stability::effect_info(entry.effect).excitation;
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
    for (const identification::TurningStep& step :
         identification::turning_steps(inputs, model.kind, split.fit, split.select, jobs)) {
      causes.push_back(ranked_turning(step, model.kind));
      if (!prints) continue;
      fmt::print("  {:<15} {}\n", step.found.name, *causes.back().statement);
      print_values(step.found.name, "    ", step.found.specs.back().parameters, {});
    }
  }
  judgement.append(std::move(causes));
}

}  // namespace swarmcert::analysis
