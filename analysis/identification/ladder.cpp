#include "analysis/identification/ladder.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "analysis/residuals/force_residual.h"
#include "nn/files/parallel.h"

namespace swarmcert::identification {
namespace {

constexpr double kLeastFall = 0.005;

/// Root mean square of the vector residual of `model` on the flights `which`, in newton.
double rmse(residuals::Inputs inputs, const stability::Model& model, const std::vector<int>& which,
            int jobs) {
  inputs.models = {model};
  std::vector<double> squares(which.size(), 0), counts(which.size(), 0);
  files::parallel_for(static_cast<int>(which.size()), jobs, [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    std::vector<std::string> problems;
    for (const residuals::Track& track : inputs.load(static_cast<std::size_t>(which[k]), problems)) {
      if (track.position_only) continue;
      const auto r = residuals::force_residual(model, inputs.kinds, inputs.rules, track);
      for (std::size_t s = 0; s < r.size(); ++s) {
        if (track.cut[s] != residuals::Cut::kNone) continue;
        squares[k] += r[s].squaredNorm();
        counts[k] += 1;
      }
    }
  });
  double sum = 0, count = 0;
  for (std::size_t k = 0; k < squares.size(); ++k) {
    sum += squares[k];
    count += counts[k];
  }
  return count > 0 ? std::sqrt(sum / count) : 0;
}

int looks_so_far(const stability::Model& model) {
  int looks = 0;
  for (const stability::EffectSpec& effect : model.effects) looks = std::max(looks, effect.fit.test_looks);
  return looks;
}

std::vector<stability::EffectSpec> specs_of(const std::vector<Missing>& fitted) {
  std::vector<stability::EffectSpec> specs;
  for (const Missing& missing : fitted) specs.push_back(missing.spec);
  return specs;
}

}  // namespace

Split split_flights(const residuals::Inputs& inputs) {
  const auto count = static_cast<int>(inputs.found.flights.size());
  Split split;
  if (count < 3) {
    split.by_flight = false;
    split.fit = split.select = split.test = every_flight(inputs);
    return split;
  }
  for (int i = 0; i < count; ++i) {
    const bool few = count < 5;
    const bool test = few ? i == count - 1 : i % 5 == 4;
    const bool select = few ? i == count - 2 : i % 5 == 2;
    (test ? split.test : select ? split.select : split.fit).push_back(i);
  }
  return split;
}

Ladder climb(const residuals::Inputs& inputs, const LadderOptions& options, int jobs,
             const residuals::Progress& progress) {
  Ladder ladder;
  ladder.split = split_flights(inputs);
  const stability::Model& nominal = inputs.models[0];
  const std::string& kind = nominal.kind;
  std::vector<std::string> wanted = options.effects;
  if (options.automatic) {
    for (const Missing& missing : diagnose(inputs, kind, ladder.split.fit, jobs, progress).ranking)
      wanted.push_back(missing.effect);
  }
  const auto step = [&](const std::string& name, const stability::Model& model) {
    return Step{name,
                rmse(inputs, model, ladder.split.fit, jobs),
                rmse(inputs, model, ladder.split.select, jobs),
                rmse(inputs, model, ladder.split.test, jobs),
                true,
                ""};
  };
  ladder.model = nominal;
  ladder.steps.push_back(step("nominal", nominal));
  const int looks = looks_so_far(nominal) + 1;
  std::vector<std::string> accepted;
  for (const std::string& name : wanted) {
    const Step& before =
        *std::find_if(ladder.steps.rbegin(), ladder.steps.rend(), [](const Step& s) { return s.accepted; });
    const double before_select_N = before.select_rmse_N;
    std::vector<std::string> names = accepted;
    names.push_back(name);
    std::vector<Missing> fitted = fit_effects(inputs, kind, names, ladder.split.fit, jobs, progress);
    for (Missing& missing : fitted) {
      missing.spec.fit.test_looks = looks;
      if (!ladder.split.by_flight)
        missing.spec.fit.note = "fewer than three flights: selected and tested on the fit's";
    }
    stability::Model model = with_effects(nominal, specs_of(fitted));
    Step next = step(name, model);
    const bool helps = next.select_rmse_N <= (1 - kLeastFall) * before_select_N;
    if (!helps) {
      next.reason = fmt::format("the error of the select flights goes from {:.5f} to {:.5f} N",
                                before_select_N, next.select_rmse_N);
    }
    next.accepted = helps || options.keep_anyway;
    if (next.accepted) {
      for (stability::EffectSpec& effect : model.effects) {
        if (effect.name != name) continue;
        effect.fit.select_rmse_before_N = before_select_N;
        effect.fit.select_rmse_after_N = next.select_rmse_N;
        if (!helps) effect.fit.note = "kept although " + next.reason;
      }
      accepted.push_back(name);
      ladder.model = std::move(model);
      ladder.fitted = std::move(fitted);
    }
    ladder.steps.push_back(next);
  }
  return ladder;
}

}  // namespace swarmcert::identification
