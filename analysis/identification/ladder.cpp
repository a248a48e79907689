#include "analysis/identification/ladder.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "analysis/identification/rotors/rotor_fit.h"
#include "analysis/identification/scan/proposal.h"
#include "analysis/residuals/comparison.h"
#include "analysis/residuals/force_residual.h"
#include "nn/base/input_error.h"
#include "nn/base/parallel.h"

namespace swarmcert::identification {
namespace {

using stability::LadderRow;

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
      const auto r = residuals::force_residual(inputs.model_for(track), inputs.kinds, inputs.rules, track);
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

residuals::Inputs only_flights(residuals::Inputs inputs, const std::vector<int>& which) {
  std::vector<residuals::FlightFiles> flights;
  for (const int i : which) flights.push_back(inputs.found.flights[static_cast<std::size_t>(i)]);
  inputs.found.flights = std::move(flights);
  return inputs;
}

/// What no model can remove from the flights `which`: the white part of the spectrum.
double noise_floor_N(residuals::Inputs inputs, const stability::Model& model, const std::vector<int>& which,
                     int jobs) {
  inputs = only_flights(std::move(inputs), which);
  inputs.models = {model};
  const double floor_N = residuals::compare(inputs, jobs, [](int, int) {}).overall.noise_floor_N.norm();
  return std::isfinite(floor_N) ? floor_N : 0;
}

int looks_so_far(const stability::Model& model) {
  int looks = 0;
  for (const stability::EffectSpec& effect : model.effects) looks = std::max(looks, effect.fit.test_looks);
  for (const LadderRow& row : model.ladder) looks = std::max(looks, row.test_looks);
  return looks;
}

std::string prefix_of(const stability::EffectSpec& spec) {
  return spec.name + (spec.vehicle.empty() ? "" : "@" + spec.vehicle) + ".";
}

std::map<std::string, double> values_of(const stability::Model& model) {
  std::map<std::string, double> values;
  for (const stability::EffectSpec& spec : model.effects) {
    for (const auto& [name, value] : spec.parameters) values[prefix_of(spec) + name] = value;
  }
  return values;
}

/// Why the flights are too few to fit or to select; empty if they are not. Flights that test cannot be too few: nothing
/// depends on them.
/// @param problems gets those of all flights.
/// @param is_tested whether the flights to test have a usable record.
std::string too_poor(const residuals::Inputs& inputs, const std::string& kind, const Split& split, int jobs,
                     std::vector<std::string>& problems, bool& is_tested) {
  const auto look = [&](const std::vector<int>& which) {
    Coverage covered = coverage(inputs, kind, which, jobs);
    problems.insert(problems.end(), covered.problems.begin(), covered.problems.end());
    return covered;
  };
  const std::string poor = look(split.fit).too_poor();
  is_tested = poor.empty();
  if (!split.by_flight) return poor.empty() ? "" : "flights for the fit: " + poor;
  const bool has_select = look(split.select).records > 0;
  is_tested = look(split.test).records > 0;
  if (!is_tested) problems.push_back("nothing is tested: no usable record in the flights to test");
  if (!poor.empty()) return "flights for the fit: " + poor;
  return has_select ? "" : "the flights to select have no usable record of kind " + kind;
}

/// Every model of `inputs`, changed alike.
template <typename Change>
void change_models(residuals::Inputs& inputs, const Change& change) {
  for (stability::Model& model : inputs.models) change(model);
  for (auto& [vehicle, model] : inputs.vehicle_models) change(model);
}

/// Formulas that are to be fitted begin anew, with the shape that they have.
residuals::Inputs with_formulas_off(residuals::Inputs inputs, const std::vector<std::string>& wanted) {
  change_models(inputs, [&](stability::Model& model) {
    for (stability::EffectSpec& spec : model.effects) {
      if (spec.is_expression() && std::find(wanted.begin(), wanted.end(), spec.name) != wanted.end())
        spec = switched_off(spec);
    }
  });
  return inputs;
}

/// Puts the proposed effect `name` into the models, switched off, under a name that no other effect has; empty where
/// the scan proposes none.
std::string propose(residuals::Inputs& inputs, const Passes& passes, const std::vector<Missing>& accepted,
                    const std::string& name) {
  std::optional<stability::EffectSpec> found = proposal(passes, specs_of(accepted), name);
  if (!found) return "";
  stability::EffectSpec effect = switched_off(*found);
  const std::string base = effect.name;
  const std::vector<stability::EffectSpec>& present = inputs.models[0].effects;
  for (int k = 2; std::any_of(present.begin(), present.end(),
                              [&](const stability::EffectSpec& spec) { return spec.name == effect.name; });
       ++k)
    effect.name = base + "_" + std::to_string(k);
  change_models(inputs, [&](stability::Model& model) { model.effects.push_back(effect); });
  return effect.name;
}

void withdraw(residuals::Inputs& inputs, const std::string& name) {
  change_models(inputs, [&](stability::Model& model) {
    model.effects.erase(std::remove_if(model.effects.begin(), model.effects.end(),
                                       [&](const stability::EffectSpec& spec) { return spec.name == name; }),
                        model.effects.end());
  });
}

/// `names` fitted jointly; the factors of the rotors, if they are among them, on top of the others and last.
std::vector<Missing> fit_with_rotors(const residuals::Inputs& inputs, const std::string& kind,
                                     std::vector<std::string> names, const std::vector<int>& which, int jobs,
                                     const residuals::Progress& progress) {
  const auto rotors = std::remove(names.begin(), names.end(), kRotorThrust);
  const bool has_rotors = rotors != names.end();
  names.erase(rotors, names.end());
  std::vector<Missing> fitted;
  if (!names.empty()) fitted = fit_effects(inputs, kind, names, which, jobs, progress);
  if (!has_rotors) return fitted;
  residuals::Inputs held = inputs;
  const std::vector<stability::EffectSpec> beside = specs_of(fitted);
  change_models(held, [&](stability::Model& model) { model = with_effects(model, beside); });
  for (Missing& found : fit_rotors(held, kind, which, jobs)) fitted.push_back(std::move(found));
  return fitted;
}

/// How far the rotors of the flights `which` are from balance under `model`; empty where no flight shows it.
std::optional<double> imbalance_N(const residuals::Inputs& inputs, const stability::Model& model,
                                  const std::vector<int>& which, int jobs) {
  const std::vector<RotorLoads> loads = rotor_loads(only_flights(inputs, which), model.kind, jobs);
  if (loads.empty()) return std::nullopt;
  return rotor_imbalance_N(loads, rotor_factors_of(model));
}

/// One candidate on top of the model of the last accepted row.
struct Trial {
  LadderRow row;
  stability::Model model;
};

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
  ladder.split = options.split ? *options.split : split_flights(inputs);
  const stability::Model& nominal = inputs.models[0];
  const std::string& kind = nominal.kind;
  ladder.too_poor = too_poor(inputs, kind, ladder.split, jobs, ladder.problems, ladder.is_tested);
  if (!ladder.too_poor.empty()) return ladder;
  ladder.earlier = nominal.ladder;
  ladder.test_looks = looks_so_far(nominal) + 1;
  std::vector<std::string> wanted = options.effects;
  if (options.automatic) {
    for (const Missing& missing : missing_effects(inputs, kind, ladder.split.fit, jobs, progress)) {
      const bool each = !missing.specs.empty() && !missing.specs[0].vehicle.empty();
      wanted.push_back(each ? kVehicleOffset : missing.effect);
    }
  }
  const auto trial = [&](const std::string& effect, stability::Model model) {
    Trial next{{}, std::move(model)};
    next.row.effect = effect;
    next.row.fit_rmse_N = rmse(inputs, next.model, ladder.split.fit, jobs);
    next.row.select_rmse_N = rmse(inputs, next.model, ladder.split.select, jobs);
    next.row.values = values_of(next.model);
    return next;
  };
  std::vector<Trial> trials = {trial("nominal", nominal)};
  std::size_t best = 0;  // the last accepted trial
  std::vector<std::string> accepted;
  residuals::Inputs working = with_formulas_off(inputs, wanted);
  for (const std::string& asked : wanted) {
    std::string name = asked;
    if (is_proposal(asked)) {
      const Passes passes = {working, kind, ladder.split.fit, 0, jobs, progress};
      name = propose(working, passes, ladder.fitted, asked);
      if (name.empty()) {
        trials.push_back(trials[best]);
        trials.back().row.effect = asked;
        trials.back().row.accepted = false;
        trials.back().row.note = "what is left varies with no variable that a " + asked + " could express";
        continue;
      }
    }
    std::vector<std::string> names = accepted;
    names.push_back(name);
    const bool is_rotors = name == kRotorThrust;
    std::vector<Missing> fitted = fit_with_rotors(working, kind, names, ladder.split.fit, jobs, progress);
    const auto fresh = std::find_if(fitted.rbegin(), fitted.rend(), [&](const Missing& missing) {
      return (missing.effect == kRotorThrust) == is_rotors;
    });
    if (fresh == fitted.rend()) {
      trials.push_back(trials[best]);
      trials.back().row.effect = name;
      trials.back().row.accepted = false;
      trials.back().row.note = "no flight of the fit has slow flight with the duty of each of four motors";
      continue;
    }
    Trial next = trial(name, with_effects(working.models[0], specs_of(fitted)));
    const double before_N = trials[best].row.select_rmse_N, after_N = next.row.select_rmse_N;
    bool helps = after_N <= (1 - kLeastFall) * before_N;
    if (is_rotors) {
      const auto off_before_N = imbalance_N(inputs, trials[best].model, ladder.split.select, jobs);
      const auto off_after_N = imbalance_N(inputs, next.model, ladder.split.select, jobs);
      helps = off_before_N && *off_after_N <= (1 - kLeastFall) * *off_before_N;
      next.row.note =
          off_before_N ? fmt::format("rotors of the select flights are {:.5f} N, then {:.5f} N off balance",
                                     *off_before_N, *off_after_N)
                       : "the select flights have no slow flight with the duty of each motor";
      if (helps) next.row.note.clear();
    } else if (!helps) {
      next.row.note =
          fmt::format("the error of the select flights goes from {:.5f} to {:.5f} N", before_N, after_N);
    }
    next.row.accepted = helps || options.keep_anyway;
    if (next.row.accepted) {
      for (const stability::EffectSpec& spec : fresh->specs) {
        for (stability::EffectSpec& effect : next.model.effects) {
          if (effect.name != spec.name || effect.vehicle != spec.vehicle) continue;
          effect.fit.select_rmse_before_N = before_N;
          effect.fit.select_rmse_after_N = after_N;
          if (!helps) effect.fit.note = "kept although " + next.row.note;
        }
      }
      accepted.push_back(name);
      ladder.fitted = std::move(fitted);
      best = trials.size();
    } else {
      next.row.values = trials[best].row.values;
      if (name != asked) withdraw(working, name);
    }
    trials.push_back(std::move(next));
  }
  ladder.any_accepted = best > 0;
  ladder.model = trials[best].model;
  for (stability::EffectSpec& effect : ladder.model.effects) {
    if (effect.fit.is_empty()) continue;
    effect.fit.test_looks = ladder.test_looks;
    if (!ladder.split.by_flight && effect.fit.note.empty())
      effect.fit.note = "fewer than three flights: selected and tested on the fit's";
  }
  const double floor_N = noise_floor_N(inputs, ladder.model, ladder.split.test, jobs);
  for (Trial& t : trials) {
    t.row.test_rmse_N = rmse(inputs, t.model, ladder.split.test, jobs);
    t.row.noise_floor_N = floor_N;
    t.row.test_looks = ladder.test_looks;
    ladder.rows.push_back(std::move(t.row));
  }
  ladder.model.ladder = ladder.earlier;
  ladder.model.ladder.insert(ladder.model.ladder.end(), ladder.rows.begin(), ladder.rows.end());
  return ladder;
}

stability::Model undone(const stability::Model& model) {
  const std::vector<LadderRow>& rows = model.ladder;
  std::size_t last = rows.size();
  while (last > 0 && (!rows[last - 1].accepted || rows[last - 1].effect == "nominal")) --last;
  if (last == 0) {
    throw files::InputError({model.path, "", "ladder", "", "has no effect that 'add' accepted",
                             "only models that 'swarmcert add' wrote can be gone back from"});
  }
  --last;  // the row to undo; one before it is accepted, because a ladder starts with the nominal model
  std::size_t to = last;
  while (to > 0 && !rows[to - 1].accepted) --to;
  if (to == 0) {
    throw files::InputError({model.path, "", "ladder", "", "does not start with the nominal model", ""});
  }
  stability::Model result = model;
  const std::map<std::string, double>& values = rows[to - 1].values;
  result.effects.clear();
  for (stability::EffectSpec spec : model.effects) {
    bool present = spec.parameters.empty();
    for (auto& [name, value] : spec.parameters) {
      const auto before = values.find(prefix_of(spec) + name);
      if (before == values.end()) continue;
      present = true;
      if (value != before->second) spec.fit.interval.clear();  // those of another fit
      value = before->second;
    }
    if (present) result.effects.push_back(std::move(spec));
  }
  result.ladder.erase(result.ladder.begin() + static_cast<std::ptrdiff_t>(last), result.ladder.end());
  return result;
}

}  // namespace swarmcert::identification
