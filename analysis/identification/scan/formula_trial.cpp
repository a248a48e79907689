#include "analysis/identification/scan/formula_trial.h"

#include <algorithm>
#include <cmath>

namespace swarmcert::identification {
namespace {

int numbers_of(const FormulaTrial& trial) {
  int count = static_cast<int>(trial.form.texts.size()) + (trial.factor == ScanVariable::kCount ? 0 : 1);
  for (const FormParameter& parameter : trial.form.shape) count += parameter.lower < parameter.upper ? 1 : 0;
  return count;
}

std::string unit_of(const FormParameter& parameter, const std::string& variable_unit) {
  if (parameter.unit == FormUnit::kNone || variable_unit.empty()) return "";
  return (parameter.unit == FormUnit::kInverse ? "_1_" : "_") + variable_unit;
}

}  // namespace

double independent_samples(const EntryData& data, const FormulaTrial& trial) {
  double last = 0, products = 0, squares = 0;
  for (Eigen::Index i = 0; i < data.all.target.size(); ++i) {
    const double inputs[2] = {data.all.inputs(i, 0), data.all.inputs.cols() > 1 ? data.all.inputs(i, 1) : 0};
    const double factor = data.all.factor.size() > 0 ? data.all.factor[i] : 1;
    const double left = data.all.target[i] - value_of(trial.form, trial.fit, inputs, factor);
    const auto k = static_cast<std::size_t>(i);
    if (i > 0 && data.flight[k] == data.flight[k - 1]) products += left * last;
    squares += left * left;
    last = left;
  }
  const double rho = squares > 0 ? std::clamp(products / squares, 0.0, 0.98) : 0;
  return std::max(static_cast<double>(data.all.target.size()) * (1 - rho) / (1 + rho), 4.0);
}

double saved_bits(double mean_square, const FormulaTrial& trial, double independent) {
  const double left = std::max(trial.fit.mean_square, 1e-300);
  const double tried_bits = trial.form.is_product ? kSurely_bits : 0;
  return 0.5 * independent * std::log2(mean_square / left) -
         0.5 * numbers_of(trial) * std::log2(independent) - tried_bits;
}

FormRange range_of(const Eigen::VectorXd& values) {
  std::vector<double> sorted(values.begin(), values.end());
  std::sort(sorted.begin(), sorted.end());
  const auto at = [&](double p) {
    return sorted[static_cast<std::size_t>(p * static_cast<double>(sorted.size() - 1))];
  };
  return {at(0.01), at(0.99)};
}

std::string unit_of_coefficient(const std::string& unit, const std::string& variable_unit, int power) {
  if (power == 0 || variable_unit.empty()) return unit;
  return unit + "_per_" + variable_unit + (power > 1 ? std::to_string(power) : "");
}

void add_shapes(const FormulaTrial& trial, const std::string& unit, stability::EffectSpec& spec,
                std::vector<std::string>& texts) {
  for (std::size_t k = 0; k < trial.form.shape.size(); ++k) {
    const FormParameter& parameter = trial.form.shape[k];
    const std::string name = parameter.name + unit_of(parameter, unit);
    const double value = trial.fit.theta[k];
    spec.parameters[name] = value;
    spec.expression.bounds[name] = {std::min(parameter.lower, value), std::max(parameter.upper, value)};
    for (std::string& text : texts) replace_all(text, kShapeLetters[k], name);
    if (parameter.lower == parameter.upper) continue;
    // Range tried by identification; the step also covers parameters close to zero.
    const double step = std::max(0.2 * std::abs(value), 0.02 * (parameter.upper - parameter.lower));
    std::vector<double>& grid = spec.expression.grid[name];
    for (const double tried : {value - step, value, value + step})
      grid.push_back(std::clamp(tried, parameter.lower, parameter.upper));
  }
}

void add_coefficient(const std::string& name, double value, stability::EffectSpec& spec) {
  spec.parameters[name] = value;
  spec.expression.linear.push_back(name);
  const double most = 4 * std::abs(value) + 1e-3;
  spec.expression.bounds[name] = {-most, most};
}

}  // namespace swarmcert::identification
