#include "analysis/commands/add/causes.h"

#include <fmt/core.h>

#include <cmath>

#include "stability/effects/registry.h"
#include "stability/effects/words.h"

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

std::string plain_words(const Cause& cause, const residuals::ForceUnit& unit) {
  std::map<std::string, double> values;
  for (const auto& [name, value] : cause.parameters) values[name] = value.value;
  const std::string words = stability::in_words(cause.name, values, {unit.per_newton(), unit.name});
  return words.empty() ? "" : words + "; ";
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
