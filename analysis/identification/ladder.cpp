#include "analysis/identification/ladder.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "analysis/identification/balance/torque_balance.h"
#include "analysis/identification/ladder_errors.h"
#include "analysis/identification/remainder.h"
#include "analysis/identification/rotors/rotor_fit.h"
#include "analysis/identification/scan/proposal.h"
#include "analysis/identification/turning_search.h"
#include "analysis/identification/verdict.h"
#include "nn/base/input_error.h"

namespace swarmcert::identification {
namespace {

using stability::EffectSpec;
using stability::LadderMeasure;
using stability::LadderRow;

constexpr double kLeastFall = 0.005;
constexpr char kImbalance[] = "imbalance of the rotors";
constexpr char kRatesAhead[] = "error of body rates up to half a second ahead";
constexpr double kLeastFallOfForm = 0.01;  ///< of formulas and shapes, which are chosen among many

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

/// A candidate added to the model of the last accepted row.
struct Trial {
  LadderRow row;
  stability::Model model;
  std::vector<FlightSquares> fit, select;  ///< by flight
  std::vector<EffectSpec> turning = {};    ///< of the model, fitted to predictions
  std::size_t follows = 0;                 ///< the trial to which the effect is added
};

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
      add_torques();
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

  /// @param although why it would be refused, if it is kept nevertheless
  void accept(const Turned& next, const std::string& although = "") {
    Trial now = unmoved(next.name);
    now.row.measure = measure(next);
    now.row.note = although;
    turning_->accept(next);
    now.turning = next.specs;
    if (!although.empty()) now.turning.back().fit.note = "kept although " + although;
    now.model = with_effects(without_turning(), now.turning);
    keep(std::move(now));
  }

  LadderMeasure measure(const Turned& next) const {
    return {kRatesAhead, "rad/s", {turning_->accepted().mean_rad_s(), next.mean_rad_s()}, {}};
  }

  /// Tries an effect that turns the vehicle because the user asks for it. Returns whether it is accepted.
  bool attempt_turning(const std::string& name) {
    if (!can_turn())
      return refuse(name,
                    "no flight shows how the vehicle turns: body rates are needed, and measured rotor "
                    "speeds, or the force of each rotor at 400 Hz");
    const Turned next = turning_->with(name);
    const double ratio = turning_->error_ratio(next);
    const bool helps = ratio <= 1 - kLeastFall;
    const std::string why =
        helps ? "" : too_small_fall(std::string("the ") + kRatesAhead, 1, ratio, kLeastFall);
    if (!helps && !keeps_anyway_) return refuse(name, why);
    accept(next, why);
    return true;
  }

  /// Adds what the mean torques of the rotors show, as diagnose() does.
  void add_torques() {
    residuals::Inputs inputs = only_flights(inputs_, ladder_.split.fit);
    inputs.models = {best().model};
    std::map<std::string, std::vector<EffectSpec>> found;
    for (const TorqueBalance& balance : torque_balances(inputs, kind_, jobs_))
      if (balance.is_named()) found[balance.effect].push_back(spec_of(balance, balance.effect));
    for (auto& [effect, specs] : found) {
      if (specs.size() == 1) specs[0].vehicle.clear();
      attempt_torques(effect, specs);
    }
  }

  bool attempt_torques(const std::string& effect, const std::vector<EffectSpec>& specs) {
    const auto imbalance_on_select_N = [this](const stability::Model& model) {
      residuals::Inputs inputs = only_flights(inputs_, ladder_.split.select);
      inputs.models = {model};
      return torque_imbalance_N(inputs, kind_, jobs_);
    };
    Trial now = unmoved(effect);
    now.model = with_effects(best().model, specs);
    now.row.measure = LadderMeasure{
        kImbalance, "N", {imbalance_on_select_N(best().model), imbalance_on_select_N(now.model)}, {}};
    if (!falls(*now.row.measure)) return refuse(effect, in_words(*now.row.measure));
    change_models(working_, [&](stability::Model& model) { model = with_effects(model, specs); });
    keep(std::move(now));
    return true;
  }

  static bool falls(const LadderMeasure& measure) {
    return measure.select[0] > 0 && measure.select[1] <= (1 - kLeastFall) * measure.select[0];
  }

  static std::string in_words(const LadderMeasure& measure) {
    return too_small_fall("the " + measure.quantity, measure.select[0], measure.select[1], kLeastFall);
  }

  /// The best trial under another name: an effect that does not change the force residual.
  Trial unmoved(const std::string& effect) {
    Trial now = best();
    now.row.effect = effect;
    now.row.note.clear();
    now.row.measure.reset();
    return now;
  }

  void keep(Trial now) {
    now.row.values = ladder_values(now.model);
    now.follows = best_;
    best_ = trials_.size();
    trials_.push_back(std::move(now));
  }

  /// The best model without what was fitted to predictions.
  stability::Model without_turning() const { return with_effects(working_.models[0], specs_of(fitted_)); }

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
    Trial now = unmoved(effect);
    now.row.accepted = false;
    now.row.note = why;
    trials_.push_back(std::move(now));
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
      return refuse(
          name,
          "no flight of the fit has slow flight with the duty, command or speed of each of four rotors");
    Trial next =
        trial(name, with_effects(with_effects(working_.models[0], specs_of(fitted)), best().turning));
    next.turning = best().turning;
    next.follows = best_;
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
    if (!helps) next.row.note = too_small_fall("the error", before_N, after_N, least_fall);
    return helps;
  }

  bool raises_none(Trial& next) {
    const bool rises = rises_anywhere(best().fit, next.fit) || rises_anywhere(best().select, next.select);
    if (rises) next.row.note = "it lowers the error of some flights and raises that of others";
    return !rises;
  }

  bool balances(Trial& next) {
    const auto before_N = imbalance_N(inputs_, best().model, ladder_.split.select, jobs_);
    if (!before_N) {
      next.row.note = "the select flights have no slow flight with the force of each rotor";
      return false;
    }
    const double after_N = *imbalance_N(inputs_, next.model, ladder_.split.select, jobs_);
    next.row.measure = LadderMeasure{kImbalance, "N", {*before_N, after_N}, {}};
    if (!falls(*next.row.measure)) next.row.note = in_words(*next.row.measure);
    return next.row.note.empty();
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
    for (Trial& t : trials_) {
      if (t.row.measure && ladder_.split.by != Split::By::kNothing) t.row.measure->test = on_test(t);
      if (ladder_.split.by != Split::By::kNothing)
        t.row.test_rmse_N = rmse_N(squares_of(inputs_, t.model, ladder_.split.test, jobs_));
      t.row.noise_floor_N = floor_N;
      t.row.test_looks = ladder_.test_looks;
      ladder_.rows.push_back(std::move(t.row));
    }
    ladder_.model.ladder = ladder_.earlier;
    ladder_.model.ladder.insert(ladder_.model.ladder.end(), ladder_.rows.begin(), ladder_.rows.end());
  }

  /// Measures on the test flights what decided about `t`, before it and with it.
  std::array<double, 2> on_test(const Trial& t) const {
    const Trial& before = trials_[t.follows];
    residuals::Inputs inputs = only_flights(inputs_, ladder_.split.test);
    const auto with = [&](const stability::Model& model) {
      inputs.models = {model};
      return inputs;
    };
    if (is_turning(t.row.effect)) {
      const TurningFlights flights(with(without_turning()), kind_, every_flight(inputs), jobs_);
      if (flights.empty()) return {};
      const auto error_rad_s = [&](const Trial& trial) {
        return Turned{"", {}, flights.rate_errors(trial.turning)}.mean_rad_s();
      };
      return {error_rad_s(before), error_rad_s(t)};
    }
    if (t.row.effect != rotor_effect())
      return {torque_imbalance_N(with(before.model), kind_, jobs_),
              torque_imbalance_N(with(t.model), kind_, jobs_)};
    const auto before_N = imbalance_N(inputs_, before.model, ladder_.split.test, jobs_);
    if (!before_N) return {};
    return {*before_N, *imbalance_N(inputs_, t.model, ladder_.split.test, jobs_)};
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

std::string too_small_fall(const std::string& what, double before, double after, double least) {
  const double fall = before > 0 ? 1 - after / before : 0;
  return fmt::format("{} of the select flights {} by {:.2g} %, and should fall by {:.2g} %", what,
                     fall < 0 ? "rises" : "falls", 100 * std::abs(fall), 100 * least);
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
