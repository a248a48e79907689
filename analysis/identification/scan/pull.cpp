#include "analysis/identification/scan/pull.h"

#include <algorithm>
#include <cmath>

#include "analysis/identification/scan/formula_trial.h"

namespace swarmcert::identification {
namespace {

constexpr Eigen::Index kSamplesOfPull = 3000;

/// The distance used by a form, and the horizontal component of the force along it.
struct PullLaw {
  const char* distance;   ///< in formulas
  const char* direction;  ///< divisor of dx and dy
  bool is_central;
};
constexpr PullLaw kPullLaws[] = {{"sqrt(dx^2 + dy^2)", "max(sqrt(dx^2 + dy^2), 0.001)", false},
                                 {"sqrt(dx^2 + dy^2 + dz^2)", "max(sqrt(dx^2 + dy^2 + dz^2), 0.001)", true}};

FormData pull_rows(const ScanSamples& samples, const std::vector<Eigen::Index>& rows, bool is_central) {
  FormData data;
  const auto n = static_cast<Eigen::Index>(rows.size());
  data.inputs.resize(n, 1);
  data.factor.resize(n);
  data.target.resize(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Index row = rows[static_cast<std::size_t>(i)];
    const double lateral = samples.neighbours.lateral_m(row, 0), height = samples.neighbours.height_m(row, 0);
    const double distance = is_central ? std::hypot(lateral, height) : lateral;
    data.inputs(i, 0) = distance;
    data.factor[i] = is_central ? lateral / std::max(distance, 1e-3) : 1;
    data.target[i] = samples.residual(row, kTowardColumn);
  }
  return data;
}

EntryData pull_data(const ScanSamples& samples, bool is_central) {
  EntryData data;
  for (Eigen::Index i = 0; i < samples.size(); ++i)
    if (std::isfinite(samples.neighbours.lateral_m(i, 0))) data.rows.push_back(i);
  const auto step = std::max<std::size_t>(1, data.rows.size() / static_cast<std::size_t>(kSamplesOfPull));
  for (std::size_t i = 0; i < data.rows.size(); i += step) data.thin.push_back(data.rows[i]);
  data.all = pull_rows(samples, data.rows, is_central);
  data.few = pull_rows(samples, data.thin, is_central);
  for (const Eigen::Index row : data.rows)
    data.flight.push_back(samples.flight[static_cast<std::size_t>(row)]);
  data.mean_square =
      data.few.target.squaredNorm() / std::max(1.0, static_cast<double>(data.few.target.size()));
  return data;
}

/// Returns forms that vanish at large distances, where there are no samples, without a constant.
std::vector<Form> vanishing_forms(const FormRange& distance) {
  std::vector<Form> forms = forms_over(distance, false);
  forms.erase(std::remove_if(forms.begin(), forms.end(),
                             [](const Form& form) {
                               return form.name != "decay" && form.name != "gaussian" &&
                                      form.name != "inverse_square" && form.name != "below";
                             }),
              forms.end());
  for (Form& form : forms) form.has_offset = false;
  return forms;
}

stability::EffectSpec pull_spec(const PullLaw& law, const FormulaTrial& trial) {
  stability::EffectSpec spec;
  std::vector<std::string> texts = trial.form.texts;
  for (std::string& text : texts) replace_all(text, "{0}", law.distance);
  add_shapes(trial, "m", spec, texts);
  const std::string coefficient = "a_" + unit_of_coefficient("N", "m", trial.form.powers[0]);
  add_coefficient(coefficient, trial.fit.coefficients[0], spec);
  for (const char* const axis : {"x", "y"}) {
    spec.expression.formulas[std::string("force_") + axis + "_N"] =
        coefficient + " * (" + texts[0] + ") * d" + axis + " / " + law.direction;
  }
  spec.expression.per_neighbour = true;
  return spec;
}

}  // namespace

bool is_pull(const ScanSamples& samples, const ScanEntry& entry) {
  return samples.quantity == ScanQuantity::kForce && entry.column == kTowardColumn &&
         entry.variable == "neighbour";
}

Pull find_pull(const ScanSamples& samples) {
  Pull best;
  double independent = 0;
  for (const PullLaw& law : kPullLaws) {
    const EntryData data = pull_data(samples, law.is_central);
    if (data.few.target.size() == 0) return best;
    for (Form& form : vanishing_forms(range_of(data.few.inputs.col(0)))) {
      FormulaTrial trial;
      trial.fit = fit_form(form, data.few);
      trial.form = std::move(form);
      if (!std::isfinite(trial.fit.mean_square)) continue;
      // The same number for all forms; otherwise a form with more correlated residuals would count for less.
      if (independent == 0) independent = independent_samples(data, trial);
      trial.saved_bits = saved_bits(data.mean_square, trial, independent);
      if (!(trial.saved_bits > best.saved_bits)) continue;
      best = {trial.form.name, pull_spec(law, trial), trial.saved_bits,
              data.mean_square - trial.fit.mean_square};
    }
  }
  return best;
}

}  // namespace swarmcert::identification
