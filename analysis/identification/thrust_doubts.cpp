#include "analysis/identification/thrust_doubts.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>

#include "analysis/identification/covariance.h"
#include "analysis/identification/diagnose.h"
#include "analysis/identification/doubts.h"
#include "analysis/identification/remainder.h"

namespace swarmcert::identification {
namespace {

constexpr double kClearlyBetter_z = 2;

/// The same flights with all effects of `ranking` except the thrust_ratio in the model.
class Beside {
 public:
  Beside(const Passes& passes, const std::vector<Missing>& ranking)
      : inputs_(inputs_with(passes, others(ranking))),
        covered_(coverage(inputs_, passes.kind, every_flight(inputs_), passes.jobs)),
        passes_{inputs_, passes.kind, every_flight(inputs_), covered_.records, passes.jobs, [](int, int) {}} {
  }
  Beside(const Beside&) = delete;
  Beside& operator=(const Beside&) = delete;

  const Passes& passes() const { return passes_; }
  const stability::Model& model() const { return *inputs_.model_of(passes_.kind); }
  Candidate named(const std::string& effect) const { return candidate(effect, model(), covered_); }

 private:
  static std::vector<stability::EffectSpec> others(const std::vector<Missing>& ranking) {
    std::vector<Missing> kept;
    std::copy_if(ranking.begin(), ranking.end(), std::back_inserter(kept),
                 [](const Missing& missing) { return !is_plain_scale(missing.effect); });
    return specs_of(kept);
  }

  residuals::Inputs inputs_;
  Coverage covered_;
  Passes passes_;
};

/// Returns a vertical formula as a candidate without its offset.
std::optional<Candidate> without_offset(const Formula& formula, const stability::Model& model) {
  constexpr char kOffset[] = "offset_N";
  const auto& formulas = formula.effect.expression.formulas;
  const bool is_vertical = std::any_of(formulas.begin(), formulas.end(), [](const auto& entry) {
    return entry.first == "force_z_N" || entry.first == "force_b3_N";
  });
  if (!is_vertical || formula.effect.parameters.count(kOffset) == 0) return std::nullopt;
  Candidate result = candidate_of(formula, model);
  for (stability::Parameter& parameter : result.info.linear) {
    if (parameter.name == kOffset) parameter.lower = parameter.upper = 0;
  }
  return result;
}

/// Returns whether `ratio` is the mean of this force, see is_mean_of_a_force().
bool is_mean_of(const Candidate& force, const Beside& beside, const Missing& ratio) {
  constexpr double kMost = 0.5;  // of the ratio
  enum Place { kOfRatio, kOfForce };
  const Grams grams = block_grams(beside.passes(), {beside.named(ratio.effect), force});
  const Selection selection(grams);
  if (!selection.is_sound()) return false;
  const Members by_ratio = {{kOfRatio, 0}}, by_force = {selection.best_theta({}, kOfForce)};
  if (paired_z(selection.block_errors(by_ratio), selection.block_errors(by_force)) < kClearlyBetter_z)
    return false;
  const Members both = with(by_ratio, selection.best_theta(by_ratio, kOfForce));
  const std::vector<Refined> refined = refine(beside.passes(), grams, both);
  if (refined.size() != both.size()) return false;
  const Interval& left = refined[0].linear_intervals[0];
  const double most = kMost * std::abs(ratio.parameters.at(ratio.coefficients[0]));
  return left.lower > -most && left.upper < most;
}

}  // namespace

bool is_mean_of_a_force(const Passes& passes, const std::vector<Missing>& ranking,
                        const std::vector<Formula>& formulas) {
  const auto ratio = std::find_if(ranking.begin(), ranking.end(),
                                  [](const Missing& missing) { return is_plain_scale(missing.effect); });
  const stability::Model& model = *passes.inputs.model_of(passes.kind);
  if (ratio == ranking.end() || !may_be_part(*ratio, model.weight_N()) || formulas.empty()) return false;
  const Beside beside(passes, ranking);
  return std::any_of(formulas.begin(), formulas.end(), [&](const Formula& formula) {
    const std::optional<Candidate> force = without_offset(formula, model);
    return force && is_mean_of(*force, beside, *ratio);
  });
}

}  // namespace swarmcert::identification
