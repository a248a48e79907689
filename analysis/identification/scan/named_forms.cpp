#include "analysis/identification/scan/named_forms.h"

#include <algorithm>

#include "stability/effects/hint.h"
#include "stability/effects/registry.h"

namespace swarmcert::identification {
namespace {

bool is_same(const Candidate& a, const Candidate& b) { return a.name == b.name && a.thetas == b.thetas; }

}  // namespace

bool needs_scan(const std::string& effect) {
  return stability::traits_of(effect).shown_by == stability::ShownBy::kCurve;
}

std::vector<Candidate> named_forms(const std::vector<Formula>& formulas, const stability::Model& model,
                                   const Coverage& coverage) {
  std::vector<Candidate> all;
  for (const Formula& formula : formulas) {
    const stability::Hint hint = {formula.form, formula.variable, formula.effect, model.weight_N()};
    for (const std::string& name : stability::effect_names()) {
      const bool has_it = std::any_of(model.effects.begin(), model.effects.end(),
                                      [&](const auto& spec) { return spec.name == name; });
      if (has_it || !needs_scan(name) || !stability::traits_of(name).varies_with(formula.variable)) continue;
      Candidate next = candidate(name, model, coverage);
      stability::Start start = {next.info, next.thetas};
      if (!stability::make_effect(next.spec, {"", {}, model.path})->start_at(hint, start)) continue;
      next.info = std::move(start.info);
      next.thetas = std::move(start.thetas);
      const bool is_known =
          std::any_of(all.begin(), all.end(), [&](const Candidate& other) { return is_same(other, next); });
      if (!is_known) all.push_back(std::move(next));
    }
  }
  return all;
}

}  // namespace swarmcert::identification
