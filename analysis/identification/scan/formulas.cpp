#include "analysis/identification/scan/formulas.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "analysis/identification/scan/form_reach.h"
#include "analysis/identification/scan/formula_trial.h"
#include "analysis/identification/scan/pull.h"
#include "nn/base/doubles.h"
#include "nn/base/parallel.h"
#include "stability/effect_text.h"
#include "stability/effects/registry.h"

namespace swarmcert::identification {
namespace {

constexpr Eigen::Index kSamplesOfFit = 3000;
constexpr const char* kBodyConstant = "body_constant";
/// Factors by which a form may be multiplied.
constexpr ScanVariable kFactors[] = {ScanVariable::kThrust, ScanVariable::kX,    ScanVariable::kY,
                                     ScanVariable::kZ,      ScanVariable::kVx,   ScanVariable::kVy,
                                     ScanVariable::kVz,     ScanVariable::kSpeed};

/// True for velocities and rates: zero means no motion, so forms may depend on the sign or the absolute value.
bool has_origin(ScanVariable v) {
  using V = ScanVariable;
  constexpr V kSuch[] = {V::kVx,    V::kVy,    V::kVz,    V::kBodyVx, V::kBodyVy,
                         V::kClimb, V::kRateX, V::kRateY, V::kRateZ};
  return std::find(std::begin(kSuch), std::end(kSuch), v) != std::end(kSuch);
}

FormData rows_of(const ScanSamples& samples, const ScanEntry& entry, const std::vector<Eigen::Index>& rows) {
  FormData data;
  const auto n = static_cast<Eigen::Index>(rows.size());
  data.inputs.resize(n, static_cast<Eigen::Index>(entry.variables.size()));
  data.target.resize(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Index row = rows[static_cast<std::size_t>(i)];
    for (std::size_t k = 0; k < entry.variables.size(); ++k)
      data.inputs(i, static_cast<Eigen::Index>(k)) =
          samples.values(row, static_cast<Eigen::Index>(entry.variables[k]));
    data.target[i] = samples.residual(row, entry.column);
  }
  return data;
}

EntryData data_of(const ScanSamples& samples, const ScanEntry& entry) {
  EntryData data;
  for (Eigen::Index i = 0; i < samples.size(); ++i) {
    const bool known = std::all_of(entry.variables.begin(), entry.variables.end(), [&](ScanVariable v) {
      return std::isfinite(samples.values(i, static_cast<Eigen::Index>(v)));
    });
    if (known) data.rows.push_back(i);
  }
  const Eigen::Index step =
      std::max<Eigen::Index>(1, static_cast<Eigen::Index>(data.rows.size()) / kSamplesOfFit);
  for (std::size_t i = 0; i < data.rows.size(); i += static_cast<std::size_t>(step))
    data.thin.push_back(data.rows[i]);
  data.all = rows_of(samples, entry, data.rows);
  data.few = rows_of(samples, entry, data.thin);
  for (const Eigen::Index row : data.rows)
    data.flight.push_back(samples.flight[static_cast<std::size_t>(row)]);
  const double mean = data.few.target.mean();
  data.mean_square = (data.few.target.array() - mean).square().mean();
  return data;
}

Eigen::VectorXd factor_of(const ScanSamples& samples, const std::vector<Eigen::Index>& rows,
                          ScanVariable factor) {
  Eigen::VectorXd values(static_cast<Eigen::Index>(rows.size()));
  for (std::size_t i = 0; i < rows.size(); ++i)
    values[static_cast<Eigen::Index>(i)] = samples.values(rows[i], static_cast<Eigen::Index>(factor));
  return values;
}

bool is_of_neighbours(const ScanEntry& entry) {
  return !entry.variables.empty() && entry.variables[0] == ScanVariable::kNeighbourX;
}

/// Returns forms over a vertical section, with parameters named after its axes.
std::vector<Form> forms_of_section(const ScanEntry& entry, const EntryData& data) {
  std::vector<Form> forms =
      forms_over_section(range_of(data.few.inputs.col(0)), range_of(data.few.inputs.col(1)));
  for (Form& form : forms) {
    for (FormParameter& parameter : form.shape) {
      if (parameter.name.rfind("x_", 0) == 0)
        parameter.name.replace(0, 1, scan_variable(entry.variables[0]).name);
      else if (parameter.name.rfind("y_", 0) == 0)
        parameter.name.replace(0, 1, scan_variable(entry.variables[1]).name);
    }
  }
  return forms;
}

std::vector<Form> forms_of(const ScanEntry& entry, const EntryData& data) {
  std::vector<Form> forms;
  if (entry.variables.size() == 2 && entry.variables[1] == ScanVariable::kZ)
    return forms_of_section(entry, data);
  if (entry.variables.size() == 2) {
    forms = forms_over_place(range_of(data.few.inputs.col(0)), range_of(data.few.inputs.col(1)));
    // Neighbours far away must have no effect.
    const auto reaches_far = [](const Form& form) {
      return form.name == "plane" || form.name == "beyond" || form.is_product;
    };
    if (is_of_neighbours(entry))
      forms.erase(std::remove_if(forms.begin(), forms.end(), reaches_far), forms.end());
    return forms;
  }
  forms = forms_over(range_of(data.few.inputs.col(0)), has_origin(entry.variables[0]));
  for (Form& form : forms) {
    if (form.name != "sinusoid") continue;
    constexpr double kFullTurn = 6.283185307179586;
    if (entry.period_s > 0)
      form.shape[0].starts = {0.99 * kFullTurn / entry.period_s, kFullTurn / entry.period_s,
                              1.01 * kFullTurn / entry.period_s};
    if (entry.variables[0] == ScanVariable::kHeading) form.shape[0].starts = {1, 2, 3};
  }
  return forms;
}

/// Returns the best form of an entry, with or without a factor.
FormulaTrial best_trial(const ScanSamples& samples, const ScanEntry& entry, EntryData& data) {
  std::vector<FormulaTrial> trials;
  for (Form& form : forms_of(entry, data)) {
    FormFit fit = fit_form(form, data.few);
    if (std::isfinite(fit.mean_square)) trials.push_back({std::move(form), std::move(fit)});
  }
  const auto least = std::min_element(
      trials.begin(), trials.end(),
      [](const FormulaTrial& a, const FormulaTrial& b) { return a.fit.mean_square < b.fit.mean_square; });
  if (least == trials.end()) return {};
  const double independent = independent_samples(data, *least);
  for (FormulaTrial& trial : trials) trial.saved_bits = saved_bits(data.mean_square, trial, independent);
  std::stable_sort(trials.begin(), trials.end(),
                   [](const FormulaTrial& a, const FormulaTrial& b) { return a.saved_bits > b.saved_bits; });
  FormulaTrial best = trials[0];
  for (std::size_t t = 0; t < std::min<std::size_t>(2, trials.size()); ++t) {
    for (const ScanVariable factor : kFactors) {
      if (std::find(entry.variables.begin(), entry.variables.end(), factor) != entry.variables.end())
        continue;
      data.few.factor = factor_of(samples, data.thin, factor);
      FormulaTrial product = {trials[t].form, fit_form(trials[t].form, data.few, trials[t].fit.theta),
                              factor};
      product.saved_bits = saved_bits(data.mean_square, product, independent);
      if (product.saved_bits > std::max(best.saved_bits, trials[0].saved_bits + kSurely_bits))
        best = std::move(product);
    }
    data.few.factor.resize(0);
  }
  best.mean_square = data.mean_square;
  best.independent = independent;
  return best;
}

/// Makes formulas over different variables comparable by using the smallest number of independent samples for all.
void count_alike(const std::vector<FormulaTrial>& trials, std::vector<Formula>& formulas) {
  double least = kInfinity;
  for (const FormulaTrial& trial : trials)
    least = trial.independent > 0 ? std::min(least, trial.independent) : least;
  for (std::size_t i = 0; i < trials.size(); ++i) {
    if (trials[i].independent > 0)
      formulas[i].saved_bits = saved_bits(trials[i].mean_square, trials[i], least);
  }
}

const ScanColumn& column_of_entry(const ScanSamples& samples, int column) {
  return scan_columns(samples.quantity)[static_cast<std::size_t>(column)];
}

/// Returns the column: vertical forces act along the world's axis or along the thrust, whichever leaves less.
int column_of(const ScanSamples& samples, const ScanEntry& entry, const EntryData& data,
              const FormulaTrial& trial) {
  constexpr int kVertical = 2, kThrust = 5;
  if (samples.quantity != ScanQuantity::kForce || entry.column % 3 != 2) return entry.column;
  double world = 0, body = 0;
  for (std::size_t i = 0; i < data.rows.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const double inputs[2] = {data.all.inputs(k, 0), data.all.inputs.cols() > 1 ? data.all.inputs(k, 1) : 0};
    const double factor = trial.factor == ScanVariable::kCount
                              ? 1
                              : samples.values(data.rows[i], static_cast<Eigen::Index>(trial.factor));
    const double value = value_of(trial.form, trial.fit, inputs, factor);
    world += value * samples.residual(data.rows[i], kVertical);
    body += value * samples.residual(data.rows[i], kThrust);
  }
  return body > world ? kThrust : kVertical;
}

/// True for variables by which other flights may lie anywhere, so that no trend of these flights can go on: places,
/// the battery, time.
bool is_somewhere(ScanVariable v) {
  using V = ScanVariable;
  constexpr V kSuch[] = {V::kX, V::kY, V::kZ, V::kBattery, V::kTime};
  return std::find(std::begin(kSuch), std::end(kSuch), v) != std::end(kSuch);
}

/// Returns the symbol of a variable, held at the ends of `range`.
std::string held_within(ScanVariable v, const FormRange& range) {
  return fmt::format("min(max({}, {:.4g}), {:.4g})", scan_variable(v).symbol, range.lower, range.upper);
}

/// Replaces {0} and {1} by the symbols of the entry's variables. Those in which the form grows are held at the ends of
/// the range of these flights.
void add_variables(const ScanEntry& entry, const EntryData& data, const FormulaTrial& trial,
                   std::vector<std::string>& texts) {
  std::vector<FormRange> ranges;
  for (Eigen::Index k = 0; k < data.all.inputs.cols(); ++k)
    ranges.push_back(range_of(data.all.inputs.col(k)));
  for (std::size_t k = 0; k < ranges.size(); ++k) {
    const ScanVariable v = entry.variables[k];
    const bool is_held = is_somewhere(v) && grows_beyond(trial.form, trial.fit.theta, ranges, k);
    const std::string symbol = is_held ? held_within(v, ranges[k]) : scan_variable(v).symbol;
    for (std::string& text : texts) replace_all(text, k == 0 ? "{0}" : "{1}", symbol);
  }
}

stability::EffectSpec spec_of(const ScanSamples& samples, const ScanEntry& entry, const EntryData& data,
                              const char* target, const FormulaTrial& trial) {
  stability::EffectSpec spec;
  const std::string unit = scan_variable(entry.variables[0]).unit;
  std::vector<std::string> texts = trial.form.texts;
  add_variables(entry, data, trial, texts);
  add_shapes(trial, unit, spec, texts);
  std::string formula;
  const auto add = [&](const std::string& letter, const std::string& text, double value,
                       const std::string& of) {
    const std::string name = letter + "_" + of;
    add_coefficient(name, value, spec);
    formula += (formula.empty() ? "" : " + ") + name + (text.empty() ? "" : " * " + text);
  };
  const char* const letters[] = {"a", "b"};
  for (std::size_t k = 0; k < texts.size(); ++k) {
    std::string text = "(" + texts[k] + ")";
    if (trial.factor != ScanVariable::kCount)
      text += " * " + (is_somewhere(trial.factor)
                           ? held_within(trial.factor, range_of(factor_of(samples, data.rows, trial.factor)))
                           : scan_variable(trial.factor).symbol);
    std::string of = unit_of_coefficient(entry.unit, unit, trial.form.powers[k]);
    if (trial.factor != ScanVariable::kCount) of += std::string("_per_") + scan_variable(trial.factor).unit;
    add(letters[k], text, trial.fit.coefficients[static_cast<Eigen::Index>(k)], of);
  }
  // With neighbours, the constant is what acts without them.
  spec.expression.per_neighbour = is_of_neighbours(entry);
  if (trial.form.has_offset && !spec.expression.per_neighbour)
    add("offset", "", trial.fit.coefficients[trial.fit.coefficients.size() - 1], entry.unit);
  spec.expression.formulas[target] = formula;
  spec.name = fmt::format("{}{}_{}{}_of_{}", kFormulaPrefix, trial.form.name,
                          entry.frame == "body" ? "body_" : "", entry.axis, entry.variable);
  if (trial.factor != ScanVariable::kCount)
    spec.name += std::string("_and_") + scan_variable(trial.factor).name;
  return spec;
}

/// Returns a constant along each axis of the body.
Formula body_constant(const ScanSamples& samples, const ScanEntry& entry) {
  const double independent = std::max(kIndependentSamples * static_cast<double>(samples.size()), 4.0);
  Formula formula;
  formula.form = "constant";
  formula.variable = kBodyConstant;
  formula.share = entry.share;
  formula.saved_bits =
      -0.5 * independent * std::log2(std::max(1 - entry.share, 1e-6)) - 1.5 * std::log2(independent);
  stability::EffectSpec& spec = formula.effect;
  spec.name = std::string(kFormulaPrefix) + kBodyConstant;
  for (int axis = 0; axis < 3; ++axis) {
    const std::string name = fmt::format("b{}_N", axis + 1);
    const double value = samples.residual.col(3 + axis).mean();
    add_coefficient(name, value, spec);
    spec.expression.formulas[fmt::format("force_b{}_N", axis + 1)] = name;
  }
  return formula;
}

bool has_formula(const ScanSamples& samples, const ScanEntry& entry) {
  if (is_pull(samples, entry)) return true;
  if (column_of_entry(samples, entry.column).target[0] == '\0') return false;
  if (entry.variable == kBodyConstant) return true;
  return !entry.variables.empty() &&
         std::all_of(entry.variables.begin(), entry.variables.end(),
                     [](ScanVariable v) { return scan_variable(v).symbol[0] != '\0'; });
}

}  // namespace

bool is_formula(const std::string& effect) { return effect.rfind(kFormulaPrefix, 0) == 0; }

std::vector<Formula> find_formulas(const ScanSamples& samples, const Scan& scan, std::size_t most_entries,
                                   int jobs) {
  std::vector<std::size_t> which;
  for (std::size_t e = 0; e < scan.entries.size() && which.size() < most_entries; ++e) {
    if (has_formula(samples, scan.entries[e])) which.push_back(e);
  }
  double total = 0;
  if (samples.size() > 0 && samples.quantity == ScanQuantity::kForce) {
    const auto world = samples.residual.leftCols(3).cast<double>().eval();
    total = (world.rowwise() - world.colwise().mean()).squaredNorm() / static_cast<double>(samples.size());
  }
  std::vector<Formula> formulas(which.size());
  std::vector<FormulaTrial> trials(which.size());
  files::parallel_for(static_cast<int>(which.size()), jobs, [&](int i) {
    const std::size_t e = which[static_cast<std::size_t>(i)];
    const ScanEntry& entry = scan.entries[e];
    if (entry.variable == kBodyConstant) {
      formulas[static_cast<std::size_t>(i)] = body_constant(samples, entry);
      formulas[static_cast<std::size_t>(i)].entry = e;
      return;
    }
    Formula& formula = formulas[static_cast<std::size_t>(i)];
    formula.entry = e;
    formula.variable = entry.variable;
    if (is_pull(samples, entry)) {
      const Pull pull = find_pull(samples);
      formula.form = pull.form;
      formula.saved_bits = pull.saved_bits;
      formula.share = pull.explained_N2 / std::max(total, 1e-300);
      formula.effect = pull.effect;
      formula.effect.name = kFormulaPrefix + pull.form + "_toward_neighbours";
      return;
    }
    EntryData data = data_of(samples, entry);
    const FormulaTrial trial = best_trial(samples, entry, data);
    formula.form = trial.form.name;
    if (!(trial.saved_bits > 0)) return;
    trials[static_cast<std::size_t>(i)] = trial;
    const double of = samples.quantity == ScanQuantity::kForce ? total : data.mean_square;
    formula.share = (data.mean_square - trial.fit.mean_square) / std::max(of, 1e-300);
    ScanEntry along = entry;
    along.column = column_of(samples, entry, data, trial);
    formula.effect = spec_of(samples, along, data, column_of_entry(samples, along.column).target, trial);
  });
  count_alike(trials, formulas);
  formulas.erase(
      std::remove_if(formulas.begin(), formulas.end(), [](const Formula& f) { return !(f.saved_bits > 0); }),
      formulas.end());
  std::stable_sort(formulas.begin(), formulas.end(),
                   [](const Formula& a, const Formula& b) { return a.saved_bits > b.saved_bits; });
  return formulas;
}

Candidate candidate_of(const Formula& formula, const stability::Model& model) {
  Candidate result;
  result.name = formula.effect.name;
  result.spec = formula.effect;
  result.info = stability::make_effect(formula.effect, {"", {}, model.path})->info();
  result.thetas.emplace_back();
  for (const stability::Parameter& parameter : result.info.shape) result.thetas[0].push_back(parameter.value);
  return result;
}

std::string to_toml(const Formula& formula) { return stability::to_toml(formula.effect); }

}  // namespace swarmcert::identification
