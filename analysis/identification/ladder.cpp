#include "analysis/identification/ladder.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "analysis/identification/remainder.h"
#include "analysis/identification/rotors/rotor_fit.h"
#include "analysis/identification/scan/proposal.h"
#include "analysis/identification/turning_search.h"
#include "analysis/identification/verdict.h"
#include "analysis/residuals/comparison.h"
#include "analysis/residuals/force_residual.h"
#include "nn/base/doubles.h"
#include "nn/base/input_error.h"
#include "nn/base/parallel.h"

namespace swarmcert::identification {
namespace {

using stability::EffectSpec;
using stability::LadderRow;

constexpr double kLeastFall = 0.005;
/// Of formulas and shapes, which are chosen among many: as of the mean square of an effect that counts as found.
constexpr double kLeastFallOfForm = Thresholds{}.gain / 2;
/// Parts of a flight are at least this long. Errors are correlated over blocks of 2 s, so as much lies between parts.
constexpr double kShortestPart_s = 8, kGuard_s = 2;

/// Squared residual vectors of a flight, in N^2, and their number.
struct FlightSquares {
  double sum = 0, count = 0;
};

/// Returns the squares of the residual of `model` in the flights `which`, in their order.
std::vector<FlightSquares> squares_of(residuals::Inputs inputs, const stability::Model& model,
                                      const std::vector<int>& which, int jobs) {
  inputs.models = {model};
  std::vector<FlightSquares> all(which.size());
  files::parallel_for(static_cast<int>(which.size()), jobs, [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    std::vector<std::string> problems;
    for (const residuals::Track& track : inputs.load(static_cast<std::size_t>(which[k]), problems)) {
      if (track.position_only) continue;
      const auto r = residuals::force_residual(inputs.model_for(track), inputs.kinds, inputs.rules, track);
      for (std::size_t s = 0; s < r.size(); ++s) {
        if (track.cut[s] != residuals::Cut::kNone) continue;
        all[k].sum += r[s].squaredNorm();
        all[k].count += 1;
      }
    }
  });
  return all;
}

/// Returns the root mean square, in newton.
double rmse_N(const std::vector<FlightSquares>& flights) {
  FlightSquares all;
  for (const FlightSquares& flight : flights) {
    all.sum += flight.sum;
    all.count += flight.count;
  }
  return all.count > 0 ? std::sqrt(all.sum / all.count) : 0;
}

/// Whether the error rises in any flight by more than the fall that an effect needs. A form that only tells flights
/// from each other, such as a step over the battery, lowers the error of some and raises that of others.
bool rises_anywhere(const std::vector<FlightSquares>& before, const std::vector<FlightSquares>& after) {
  for (std::size_t k = 0; k < before.size(); ++k)
    if (rmse_N({after[k]}) > (1 + kLeastFall) * rmse_N({before[k]})) return true;
  return false;
}

residuals::Inputs only_flights(residuals::Inputs inputs, const std::vector<int>& which) {
  std::vector<residuals::FlightFiles> flights;
  for (const int i : which) flights.push_back(inputs.found.flights[static_cast<std::size_t>(i)]);
  inputs.found.flights = std::move(flights);
  return inputs;
}

/// Returns what no model can explain in the flights `which`: the white part of the spectrum.
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

/// Returns why the flights are too few to fit or to select; empty if they are sufficient. Test flights cannot be too
/// few, because nothing depends on them.
/// @param problems receives the problems of all flights
/// @param is_tested receives whether the test flights have a usable record
std::string too_poor(const residuals::Inputs& inputs, const std::string& kind, const Split& split, int jobs,
                     std::vector<std::string>& problems, bool& is_tested) {
  const auto look = [&](const std::vector<int>& which) {
    Coverage covered = coverage(inputs, kind, which, jobs);
    problems.insert(problems.end(), covered.problems.begin(), covered.problems.end());
    return covered;
  };
  const std::string poor = look(split.fit).too_poor();
  is_tested = poor.empty();
  if (split.by == Split::By::kNothing) return poor.empty() ? "" : "flights for the fit: " + poor;
  const bool has_select = look(split.select).records > 0;
  is_tested = look(split.test).records > 0;
  if (!is_tested) problems.push_back("nothing is tested: no usable record in the flights to test");
  if (!poor.empty()) return "flights for the fit: " + poor;
  return has_select ? "" : "the flights to select have no usable record of kind " + kind;
}

/// Applies the same change to each model of `inputs`.
template <typename Change>
void change_models(residuals::Inputs& inputs, const Change& change) {
  for (stability::Model& model : inputs.models) change(model);
  for (auto& [vehicle, model] : inputs.vehicle_models) change(model);
}

/// Resets the coefficients of formulas that are to be fitted, and keeps their shapes.
residuals::Inputs with_formulas_off(residuals::Inputs inputs, const std::vector<std::string>& wanted) {
  change_models(inputs, [&](stability::Model& model) {
    for (stability::EffectSpec& spec : model.effects) {
      if (spec.is_expression() && std::find(wanted.begin(), wanted.end(), spec.name) != wanted.end())
        spec = switched_off(spec);
    }
  });
  return inputs;
}

/// Adds the proposed effect `name` to the models, switched off and under a unique name, which is returned; empty if the
/// scan proposes none.
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

/// Fits `names` jointly; factors of the rotors, if among them, are fitted last on top of the others.
std::vector<Missing> fit_with_rotors(const residuals::Inputs& inputs, const std::string& kind,
                                     std::vector<std::string> names, const std::vector<int>& which, int jobs,
                                     const residuals::Progress& progress) {
  const auto rotors = std::remove(names.begin(), names.end(), rotor_effect());
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

/// Returns how far the rotors are out of balance in the flights `which` with `model`; empty if no flight shows it.
std::optional<double> imbalance_N(const residuals::Inputs& inputs, const stability::Model& model,
                                  const std::vector<int>& which, int jobs) {
  const std::vector<RotorLoads> loads = rotor_loads(only_flights(inputs, which), model.kind, jobs);
  if (loads.empty()) return std::nullopt;
  return rotor_imbalance_N(loads, rotor_factors_of(model));
}

/// Returns five parts of `flight`, as five flights are split; none if they would be too short.
std::vector<residuals::FlightFiles> parts_of(const residuals::FlightFiles& flight, Interval span_s) {
  constexpr int kParts = 5;
  const double whole_s = span_s.upper - span_s.lower;
  std::vector<residuals::FlightFiles> parts;
  if (!(whole_s / kParts >= kShortestPart_s + kGuard_s)) return parts;
  for (int k = 0; k < kParts; ++k) {
    residuals::FlightFiles part = flight;
    const double begin_s = span_s.lower + whole_s * k / kParts;
    part.part_s = {begin_s, begin_s + whole_s / kParts - kGuard_s};
    part.name += fmt::format(" {:.0f}..{:.0f} s", part.part_s->lower, part.part_s->upper);
    parts.push_back(std::move(part));
  }
  return parts;
}

/// Replaces the flights of `inputs` by their parts. Returns false, and changes nothing, if a flight is too short.
bool split_in_time(residuals::Inputs& inputs) {
  std::vector<residuals::FlightFiles> parts;
  for (std::size_t i = 0; i < inputs.found.flights.size(); ++i) {
    Interval span_s = {kInfinity, -kInfinity};
    std::vector<std::string> problems;
    for (const residuals::Track& track : inputs.load(i, problems)) {
      if (track.position_only) continue;
      for (std::size_t k = 0; k < track.cut.size(); ++k) {
        if (track.cut[k] != residuals::Cut::kNone) continue;
        span_s.lower = std::min(span_s.lower, track.instants[k].time_s);
        span_s.upper = std::max(span_s.upper, track.instants[k].time_s);
      }
    }
    std::vector<residuals::FlightFiles> own = parts_of(inputs.found.flights[i], span_s);
    if (own.empty()) return false;
    std::move(own.begin(), own.end(), std::back_inserter(parts));
  }
  inputs.found.flights = std::move(parts);
  return true;
}

/// A candidate added to the model of the last accepted row.
struct Trial {
  LadderRow row;
  stability::Model model;
  std::vector<FlightSquares> fit, select;  ///< by flight
  std::vector<EffectSpec> turning = {};    ///< of the model, fitted to predictions
};

}  // namespace

Split split_flights(residuals::Inputs& inputs) {
  Split split;
  if (inputs.found.flights.size() < 3) {
    split.by = split_in_time(inputs) ? Split::By::kTime : Split::By::kNothing;
    if (split.by == Split::By::kNothing) {
      split.fit = split.select = split.test = every_flight(inputs);
      return split;
    }
  }
  const auto count = static_cast<int>(inputs.found.flights.size());
  for (int i = 0; i < count; ++i) {
    const bool few = count < 5;
    const bool test = few ? i == count - 1 : i % 5 == 4;
    const bool select = few ? i == count - 2 : i % 5 == 2;
    (test ? split.test : select ? split.select : split.fit).push_back(i);
  }
  return split;
}

namespace {

/// Tries effects one after the other and keeps those that reduce the error on the select flights.
class Climb {
 public:
  Climb(const residuals::Inputs& inputs, const LadderOptions& options, int jobs,
        const residuals::Progress& progress, Ladder& ladder)
      : inputs_(inputs),
        kind_(inputs.models[0].kind),
        is_automatic_(options.automatic),
        keeps_anyway_(options.keep_anyway),
        jobs_(jobs),
        progress_(progress),
        ladder_(ladder),
        wanted_(options.effects) {
    if (options.automatic) add_missing();
    working_ = with_formulas_off(inputs, wanted_);
    trials_.push_back(trial("nominal", inputs.models[0]));
  }

  void run() {
    for (const std::string& asked : wanted_) attempt(asked, kLeastFall);
    if (is_automatic_) {
      ladder_.stopped = add_forms();
      add_turning();
    }
    finish();
  }

 private:
  Trial& best() { return trials_[best_]; }

  void add_missing() {
    for (const Missing& missing : missing_effects(inputs_, kind_, ladder_.split.fit, jobs_, progress_)) {
      const bool each = !missing.specs.empty() && !missing.specs[0].vehicle.empty();
      wanted_.push_back(each ? kVehicleOffset : missing.effect);
    }
  }

  Passes passes() const { return {working_, kind_, ladder_.split.fit, 0, jobs_, progress_}; }

  /// Adds formulas, or else shapes, for what is left. Returns why it stops.
  std::string add_forms() {
    hold_named();
    for (int k = 0; k < static_cast<int>(kMostFormulas); ++k) {
      if (!leaves_something()) return "nothing stands out above the noise of the flights to fit";
      if (!attempt("formula", kLeastFallOfForm) && !attempt("shape", kLeastFallOfForm))
        return "no formula or shape lowers the error of the select flights further";
    }
    return fmt::format("{} formulas and shapes were added, which is enough for one ladder", kMostFormulas);
  }

  /// Adds effects that turn the vehicle, the best one first, as long as one predicts its rates much better.
  void add_turning() {
    std::vector<std::string> left = turning_effects();
    while (can_turn()) {
      const std::optional<Turned> next = turning_->best_of(left);
      if (!next) return;
      accept(*next);
      left.erase(std::find(left.begin(), left.end(), next->name));
    }
  }

  /// Loads the flights once, with the forces found so far.
  bool can_turn() {
    if (!turning_) {
      residuals::Inputs inputs = inputs_;
      inputs.models = {best().model};
      turning_.emplace(inputs, kind_, ladder_.split.fit, ladder_.split.select, jobs_);
    }
    return turning_->is_possible();
  }

  void accept(const Turned& next) {
    best().row.select_rates_rad_s = turning_->rates_rad_s();
    turning_->accept(next);
    Trial now = best();
    now.row.effect = next.name;
    now.row.note.clear();
    now.row.select_rates_rad_s = turning_->rates_rad_s();
    now.turning = next.specs;
    now.model = with_effects(without_turning(), next.specs);
    now.row.values = ladder_values(now.model);
    trials_.push_back(std::move(now));
    best_ = trials_.size() - 1;
  }

  /// Tries an effect that turns the vehicle because the user asks for it. Returns whether it is accepted.
  bool attempt_turning(const std::string& name) {
    if (!can_turn())
      return refuse(name,
                    "no flight shows how the vehicle turns: body rates are needed, and measured rotor "
                    "speeds, or the force of each rotor at 400 Hz");
    const Turned next = turning_->with(name);
    if (turning_->error_ratio(next) > 1 - kLeastFall && !keeps_anyway_)
      return refuse(name, fmt::format("the error of predicted body rates goes from {:.4f} to {:.4f} rad/s",
                                      turning_->rates_rad_s(), TurningSearch::rates_rad_s(next)));
    accept(next);
    return true;
  }

  /// The best model without what was fitted to predictions.
  stability::Model without_turning() { return with_effects(working_.models[0], specs_of(fitted_)); }

  /// Whether the accepted effects leave slow disturbances, a vibration, or a force of which a variable explains much.
  bool leaves_something() const {
    const std::vector<stability::EffectSpec> specs = specs_of(fitted_);
    if (remainder(passes(), specs).stands_out()) return true;
    const Scan found = scan(scan_samples(passes(), specs), jobs_);
    return !found.entries.empty() && found.entries[0].share >= kMuchOfForce;
  }

  /// Makes the named effects part of the model: a form may resemble one of them, and would take a part of it.
  void hold_named() {
    change_models(working_, [specs = specs_of(fitted_)](stability::Model& model) {
      model = with_effects(model, specs);
    });
    fitted_.clear();
    accepted_.clear();
  }

  Trial trial(const std::string& effect, stability::Model model) const {
    Trial next{{}, std::move(model), {}, {}};
    next.row.effect = effect;
    next.fit = squares_of(inputs_, next.model, ladder_.split.fit, jobs_);
    next.select = squares_of(inputs_, next.model, ladder_.split.select, jobs_);
    next.row.fit_rmse_N = rmse_N(next.fit);
    next.row.select_rmse_N = rmse_N(next.select);
    next.row.values = ladder_values(next.model);
    return next;
  }

  /// Adds a row that repeats the best one. Returns false.
  bool refuse(const std::string& effect, const std::string& why) {
    trials_.push_back(best());
    trials_.back().row.effect = effect;
    trials_.back().row.accepted = false;
    trials_.back().row.note = why;
    return false;
  }

  /// Tries an effect, a formula or a shape. Returns whether it is accepted.
  /// @param least_fall of the RMSE on the select flights
  bool attempt(const std::string& asked, double least_fall) {
    if (is_turning(asked)) return attempt_turning(asked);
    std::string name = asked;
    if (is_proposal(asked)) {
      name = propose(working_, passes(), fitted_, asked);
      if (name.empty())
        return refuse(asked,
                      fmt::format("the remainder of the {} flights to fit does not vary significantly with "
                                  "any variable that a {} could express; more flights may show one",
                                  ladder_.split.fit.size(), asked));
    }
    std::vector<std::string> names = accepted_;
    names.push_back(name);
    const bool is_rotors = name == rotor_effect();
    std::vector<Missing> fitted =
        fit_with_rotors(working_, kind_, names, ladder_.split.fit, jobs_, progress_);
    const auto fresh = std::find_if(fitted.rbegin(), fitted.rend(), [&](const Missing& missing) {
      return (missing.effect == rotor_effect()) == is_rotors;
    });
    if (fresh == fitted.rend())
      return refuse(name, "no flight of the fit has slow flight with the duty of each of four motors");
    Trial next =
        trial(name, with_effects(with_effects(working_.models[0], specs_of(fitted)), best().turning));
    next.turning = best().turning;
    const bool is_form = name != asked && is_automatic_;
    const bool helps =
        is_rotors ? balances(next) : lowers_error(next, least_fall) && (!is_form || raises_none(next));
    next.row.accepted = helps || (keeps_anyway_ && !is_form);
    if (next.row.accepted) {
      note_errors(*fresh, helps, next);
      accepted_.push_back(name);
      fitted_ = std::move(fitted);
      best_ = trials_.size();
    } else {
      next.row.values = best().row.values;
      if (name != asked) withdraw(working_, name);
    }
    const bool is_accepted = next.row.accepted;
    trials_.push_back(std::move(next));
    return is_accepted;
  }

  bool lowers_error(Trial& next, double least_fall) {
    const double before_N = best().row.select_rmse_N, after_N = next.row.select_rmse_N;
    const bool helps = after_N <= (1 - least_fall) * before_N;
    if (!helps)
      next.row.note =
          fmt::format("the error of the select flights goes from {:.5f} to {:.5f} N", before_N, after_N);
    return helps;
  }

  bool raises_none(Trial& next) {
    const bool rises = rises_anywhere(best().fit, next.fit) || rises_anywhere(best().select, next.select);
    if (rises) next.row.note = "it lowers the error of some flights and raises that of others";
    return !rises;
  }

  bool balances(Trial& next) {
    const auto before_N = imbalance_N(inputs_, best().model, ladder_.split.select, jobs_);
    const auto after_N = imbalance_N(inputs_, next.model, ladder_.split.select, jobs_);
    const bool helps = before_N && *after_N <= (1 - kLeastFall) * *before_N;
    if (!before_N)
      next.row.note = "the select flights have no slow flight with the duty of each motor";
    else if (!helps)
      next.row.note = fmt::format("the rotor imbalance of the select flights goes from {:.5f} to {:.5f} N",
                                  *before_N, *after_N);
    return helps;
  }

  /// Stores the errors in the model file, with the effect fitted last.
  void note_errors(const Missing& fresh, bool helps, Trial& next) {
    for (const stability::EffectSpec& spec : fresh.specs) {
      for (stability::EffectSpec& effect : next.model.effects) {
        if (effect.name != spec.name || effect.vehicle != spec.vehicle) continue;
        effect.fit.select_rmse_before_N = best().row.select_rmse_N;
        effect.fit.select_rmse_after_N = next.row.select_rmse_N;
        if (!helps) effect.fit.note = "kept although " + next.row.note;
      }
    }
  }

  /// The test flights are used once, after all decisions.
  void finish() {
    ladder_.any_accepted = best_ > 0;
    ladder_.model = best().model;
    for (stability::EffectSpec& effect : ladder_.model.effects) {
      if (effect.fit.is_empty()) continue;
      effect.fit.test_looks = ladder_.test_looks;
      if (ladder_.split.by == Split::By::kNothing && effect.fit.note.empty())
        effect.fit.note = "one or two short flights: selected on the flights to fit, and not tested";
    }
    const double floor_N = noise_floor_N(inputs_, ladder_.model, ladder_.split.test, jobs_);
    test_turning();
    for (Trial& t : trials_) {
      if (ladder_.split.by != Split::By::kNothing)
        t.row.test_rmse_N = rmse_N(squares_of(inputs_, t.model, ladder_.split.test, jobs_));
      t.row.noise_floor_N = floor_N;
      t.row.test_looks = ladder_.test_looks;
      ladder_.rows.push_back(std::move(t.row));
    }
    ladder_.model.ladder = ladder_.earlier;
    ladder_.model.ladder.insert(ladder_.model.ladder.end(), ladder_.rows.begin(), ladder_.rows.end());
  }

  void test_turning() {
    if (best().turning.empty() || ladder_.split.by == Split::By::kNothing) return;
    residuals::Inputs inputs = inputs_;
    inputs.models = {without_turning()};
    const TurningFlights test(inputs, kind_, ladder_.split.test, jobs_);
    for (Trial& t : trials_) {
      if (test.empty() || !(t.row.select_rates_rad_s > 0)) continue;
      t.row.test_rates_rad_s = TurningSearch::rates_rad_s({"", {}, test.rate_errors_rad_s(t.turning)});
    }
  }

  const residuals::Inputs& inputs_;
  const std::string kind_;
  const bool is_automatic_, keeps_anyway_;
  const int jobs_;
  const residuals::Progress& progress_;
  Ladder& ladder_;
  std::vector<std::string> wanted_, accepted_;
  residuals::Inputs working_;    ///< with the proposed effects
  std::vector<Missing> fitted_;  ///< as of the last accepted row, except for what is part of working_
  std::vector<Trial> trials_;
  std::size_t best_ = 0;                  ///< the last accepted trial
  std::optional<TurningSearch> turning_;  ///< see can_turn()
};

}  // namespace

Ladder climb(residuals::Inputs inputs, const LadderOptions& options, int jobs,
             const residuals::Progress& progress) {
  Ladder ladder;
  ladder.split = options.split ? *options.split : split_flights(inputs);
  for (const residuals::FlightFiles& flight : inputs.found.flights) ladder.flights.push_back(flight.name);
  const stability::Model& nominal = inputs.models[0];
  ladder.too_poor = too_poor(inputs, nominal.kind, ladder.split, jobs, ladder.problems, ladder.is_tested);
  if (!ladder.too_poor.empty()) return ladder;
  ladder.earlier = nominal.ladder;
  ladder.test_looks = looks_so_far(nominal) + 1;
  Climb(inputs, options, jobs, progress, ladder).run();
  return ladder;
}

std::string ladder_key(const stability::EffectSpec& effect, const std::string& parameter) {
  return effect.name + (effect.vehicle.empty() ? "" : "@" + effect.vehicle) + "." + parameter;
}

std::map<std::string, double> ladder_values(const stability::Model& model) {
  std::map<std::string, double> values;
  for (const stability::EffectSpec& spec : model.effects)
    for (const auto& [name, value] : spec.parameters) values[ladder_key(spec, name)] = value;
  return values;
}

stability::Model undone(const stability::Model& model) {
  const std::vector<LadderRow>& rows = model.ladder;
  std::size_t last = rows.size();
  while (last > 0 && (!rows[last - 1].accepted || rows[last - 1].effect == "nominal")) --last;
  if (last == 0) {
    throw files::InputError({model.path, "", "ladder", "", "has no effect that 'add' accepted",
                             "only models written by 'swarmcert add' can be undone"});
  }
  --last;  // the row to undo; an accepted one precedes it, because a ladder starts with the nominal model
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
      const auto before = values.find(ladder_key(spec, name));
      if (before == values.end()) continue;
      present = true;
      if (value != before->second) spec.fit.interval.clear();  // it belongs to another fit
      value = before->second;
    }
    if (present) result.effects.push_back(std::move(spec));
  }
  result.ladder.erase(result.ladder.begin() + static_cast<std::ptrdiff_t>(last), result.ladder.end());
  return result;
}

}  // namespace swarmcert::identification
