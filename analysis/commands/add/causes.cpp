#include "analysis/commands/add/causes.h"

#include <fmt/core.h>

#include <cmath>

#include "stability/effects/registry.h"

namespace swarmcert::analysis {
namespace {

using identification::Ladder;
using identification::Split;
using stability::EffectSpec;
using stability::LadderRow;

/// The effects that a row added: those that have values after it and had none before; if the model had the effect, and
/// the row changed it, that one.
std::vector<const EffectSpec*> added_by(const LadderRow& row, const LadderRow& before,
                                        const std::vector<EffectSpec>& effects) {
  std::vector<const EffectSpec*> added, changed;
  for (const EffectSpec& spec : effects) {
    if (spec.parameters.empty()) continue;
    const std::string key = identification::ladder_key(spec, spec.parameters.begin()->first);
    if (row.values.count(key) != 0 && before.values.count(key) == 0) added.push_back(&spec);
    if (spec.name == row.effect) changed.push_back(&spec);
  }
  return added.empty() ? changed : added;
}

/// An effect in plain words, if the leading parameter is not zero; {name} stands for the value of a parameter.
struct Phrase {
  const char *effect, *leading;
  const char* text;
  const char* if_negative;  ///< with the leading parameter's size; null: `text`
};
constexpr Phrase kPhrases[] = {
    {"wind_field", "thermal_N", "an updraft of {thermal_N} at x {x_m}, y {y_m}, radius {radius_m}",
     "a downdraft of {thermal_N} at x {x_m}, y {y_m}, radius {radius_m}"},
    {"wind_field", "shear_x_N", "a wind of ({shear_x_N}, {shear_y_N}) above {height_m}", nullptr},
    {"constant_force", "force_x_N", "a steady force of ({force_x_N}, {force_y_N}, {force_z_N})", nullptr},
    {"drag_linear", "drag_N_s_m", "a drag of {drag_N_s_m} times the velocity", nullptr},
    {"motor_lag", "tau_s", "rotors that follow their commands with a lag of {tau_s}", nullptr},
    {"delay", "delay_s", "commands that act {delay_s} late", nullptr},
    {"payload_step", "time_s", "a load that changes from {mass_before_kg} to {mass_after_kg} at {time_s}",
     nullptr}};

/// "35.2 mN", "0.31 m": the unit is the end of the name.
std::string quantity(const std::string& name, double value, const residuals::ForceUnit& force) {
  const std::pair<const char*, const char*> kUnits[] = {
      {"_N_s_m", "N s/m"}, {"_N", ""}, {"_kg", "kg"}, {"_m", "m"}, {"_s", "s"}};
  for (const auto& [end, unit] : kUnits) {
    const std::string tail = end;
    if (name.size() < tail.size() || name.compare(name.size() - tail.size(), tail.size(), tail) != 0)
      continue;
    if (tail == "_N") return fmt::format("{:.3g} {}", value * force.per_newton(), force.name);
    return fmt::format("{:.3g} {}", value, unit);
  }
  return fmt::format("{:.3g}", value);
}

std::string plain_words(const Cause& cause, const residuals::ForceUnit& force) {
  for (const Phrase& phrase : kPhrases) {
    const auto leading = cause.parameters.find(phrase.leading);
    if (cause.name != phrase.effect || leading == cause.parameters.end() || leading->second.value == 0)
      continue;
    const bool is_negative = leading->second.value < 0 && phrase.if_negative != nullptr;
    std::string text = is_negative ? phrase.if_negative : phrase.text;
    for (const auto& [name, value] : cause.parameters) {
      const bool is_size = is_negative && name == phrase.leading;
      const std::string token = "{" + name + "}";
      const std::size_t at = text.find(token);
      if (at != text.npos)
        text.replace(at, token.size(), quantity(name, is_size ? -value.value : value.value, force));
    }
    return text + "; ";
  }
  return "";
}

std::string equation_of(const EffectSpec& spec) {
  if (!spec.is_expression()) return stability::effect_info(spec.name).equation;
  std::string text;
  for (const auto& [target, formula] : spec.expression.formulas)
    text += (text.empty() ? "" : "; ") + target + " = " + formula;
  return text;
}

Cause cause_of(const LadderRow& row, const LadderRow& before, const Ladder& ladder) {
  Cause cause;
  cause.name = row.effect;
  const bool is_tested = row.test_rmse_N > 0 && before.test_rmse_N > 0;
  cause.before_N = is_tested ? before.test_rmse_N : before.fit_rmse_N;
  cause.after_N = is_tested ? row.test_rmse_N : row.fit_rmse_N;
  if (row.measure) {
    const auto& [before_it, with_it] = row.measure->test[0] > 0 ? row.measure->test : row.measure->select;
    cause.measure = CauseMeasure{row.measure->quantity, row.measure->unit, before_it, with_it};
  }
  for (const EffectSpec* const spec : added_by(row, before, ladder.model.effects)) {
    cause.equation = equation_of(*spec);
    const std::string of = spec->vehicle.empty() ? "" : spec->vehicle + " ";
    for (const auto& [name, value] : fitted_values(spec->name, spec->parameters, spec->fit.interval))
      cause.parameters[of + name] = value;
  }
  return cause;
}

}  // namespace

void describe(files::Record& record, const CauseMeasure& measure) {
  record.field("quantity", measure.quantity, "");
  record.field("unit", measure.unit, "");
  record.field("before", measure.before, "Without the cause and those after it.", "", "estimate");
  record.field("after", measure.after, "With it.", "", "estimate");
}

void describe(files::Record& record, const Cause& cause) {
  record.field("name", cause.name, "Effect, formula or shape, as in the fitted model.");
  record.field("equation", cause.equation, "Of the force, or of what it changes.");
  record.field("parameters", cause.parameters, "Fitted values; units stand in the names.");
  record.field("rmse_before", cause.before_N, "Of the residual vector, without it and those after it.", "N",
               "estimate");
  record.field("rmse_after", cause.after_N, "With it.", "N", "estimate");
  record.may("measure", cause.measure, "What decided, if it is not the residual of the force.");
  record.field("fall_percent", cause.fall_percent(), "By which it lowers the error where `held_out` says.",
               "%", "estimate");
}

std::vector<Cause> causes_of(const Ladder& ladder) {
  std::vector<Cause> causes;
  const LadderRow* before = nullptr;
  for (const LadderRow& row : ladder.rows) {
    if (!row.accepted) continue;
    if (before != nullptr) causes.push_back(cause_of(row, *before, ladder));
    before = &row;
  }
  return causes;
}

std::string sentence(const Cause& cause, const residuals::ForceUnit& unit) {
  std::string values;
  for (const auto& [name, value] : cause.parameters) {
    const bool is_fitted = value.interval_90 && value.interval_90->lower < value.interval_90->upper;
    if (!is_fitted && !cause.measure) continue;
    const std::string of = values.empty() ? "" : ", ";
    if (!is_fitted) {
      values += fmt::format("{}{} = {:.4g}", of, name, value.value);
      continue;
    }
    values += fmt::format("{}{} = {:.4g} ({:.4g} .. {:.4g})", of, name, value.value, value.interval_90->lower,
                          value.interval_90->upper);
  }
  values = plain_words(cause, unit) + values;
  const double fall = cause.fall_percent();
  const std::string by = fmt::format("by {:.0f} %", std::abs(fall));
  const char* const moves = fall < 0 ? "raises" : "lowers";
  if (cause.measure)
    return fmt::format("{}: {}; {} the {} {}, {:.3g} to {:.3g} {}", cause.name, values, moves,
                       cause.measure->quantity, by, cause.measure->before, cause.measure->after,
                       cause.measure->unit);
  return fmt::format("{}: {}; {} the error {}, {:.3g} to {:.3g} {}", cause.name, values, moves, by,
                     cause.before_N * unit.per_newton(), cause.after_N * unit.per_newton(), unit.name);
}

std::string where_held_out(const Ladder& ladder) {
  if (!ladder.is_tested || ladder.split.by == Split::By::kNothing)
    return "the flights of the fit (too little to hold any back)";
  return ladder.split.by == Split::By::kTime ? "parts of the flights that nothing was fitted to"
                                             : "flights that nothing was fitted to";
}

}  // namespace swarmcert::analysis
