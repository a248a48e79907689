#include "analysis/identification/battery_rival.h"

#include <algorithm>

#include "analysis/identification/closed_loop.h"
#include "analysis/identification/covariance.h"
#include "analysis/identification/diagnose.h"
#include "analysis/identification/remainder.h"
#include "analysis/identification/scan/formulas.h"
#include "stability/effects/registry.h"

namespace swarmcert::identification {
namespace {

Candidate thrust_over_time(const stability::Model& model) {
  constexpr double kMost_1_s = 0.1;
  Formula formula;
  stability::EffectSpec& spec = formula.effect;
  spec.name = kThrustOverTime;
  spec.parameters["rise_1_s"] = 1e-3;
  spec.expression.linear = {"rise_1_s"};
  spec.expression.bounds["rise_1_s"] = {-kMost_1_s, kMost_1_s};
  spec.expression.formulas["force_b3_N"] = "rise_1_s * T * time";
  return candidate_of(formula, model);
}

/// Returns whether time explains the residual of `inputs` about as well as the battery, each beside a thrust ratio.
bool is_alike_over_time(const residuals::Inputs& inputs, const Passes& passes,
                        const std::string& battery_effect) {
  constexpr double kShare = 0.5, kClearlyBetter_z = 2;
  const std::vector<int> flights = every_flight(inputs);
  const stability::Model& model = *inputs.model_of(passes.kind);
  const Coverage covered = coverage(inputs, passes.kind, flights, passes.jobs);
  enum Place { kRatio, kBattery, kTime };
  const Passes beside = {inputs, passes.kind, flights, covered.records, passes.jobs, [](int, int) {}};
  const Grams grams = block_grams(
      beside, {candidate(stability::plain_effect(stability::Family::kThrustScale), model, covered),
               candidate(battery_effect, model, covered), thrust_over_time(model)});
  const Selection selection(grams);
  if (!selection.is_sound()) return false;
  const Members none = {{kRatio, 0}};
  const Members battery = with(none, {kBattery, 0}), time = with(none, {kTime, 0});
  const double before = selection.mean_square(none);
  if (!(before - selection.mean_square(time) > kShare * (before - selection.mean_square(battery))))
    return false;
  return paired_z(selection.block_errors(time), selection.block_errors(battery)) < kClearlyBetter_z;
}

}  // namespace

void name_time_beside_battery(const Passes& passes, std::vector<Missing>& ranking) {
  const auto battery = std::find_if(ranking.begin(), ranking.end(), [](const Missing& missing) {
    return is_scale(missing.effect) && !is_plain_scale(missing.effect);
  });
  if (battery == ranking.end()) return;
  std::vector<stability::EffectSpec> others;
  for (const Missing& missing : ranking) {
    if (!is_scale(missing.effect)) others.insert(others.end(), missing.specs.begin(), missing.specs.end());
  }
  if (is_alike_over_time(inputs_with(passes, others), passes, battery->effect))
    battery->finding.rivals.push_back(
        {kThrustOverTime, "flights that begin with batteries charged to different voltages"});
}

}  // namespace swarmcert::identification
