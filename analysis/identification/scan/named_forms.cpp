#include "analysis/identification/scan/named_forms.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "nn/base/pi.h"

namespace swarmcert::identification {
namespace {

constexpr double kReach = 0.3;  ///< in metres

/// Returns the parameter of a formula whose name, without its unit, begins with `word`.
std::optional<double> number_of(const Formula& formula, const std::string& word) {
  for (const auto& [name, value] : formula.effect.parameters) {
    if (name == word || name.rfind(word + "_", 0) == 0) return value;
  }
  return std::nullopt;
}

/// Returns the first of `words` that the formula has.
std::optional<double> first_of(const Formula& formula, const std::vector<std::string>& words) {
  for (const std::string& word : words) {
    if (const auto number = number_of(formula, word)) return number;
  }
  return std::nullopt;
}

bool acts_along(const Formula& formula, const std::vector<std::string>& targets) {
  const auto& formulas = formula.effect.expression.formulas;
  return std::any_of(formulas.begin(), formulas.end(), [&](const auto& entry) {
    return std::find(targets.begin(), targets.end(), entry.first) != targets.end();
  });
}

bool is_vertical(const Formula& formula) { return acts_along(formula, {"force_z_N", "force_b3_N"}); }
bool is_horizontal(const Formula& formula) {
  return acts_along(formula, {"force_x_N", "force_y_N", "force_b1_N", "force_b2_N"});
}

/// Excludes all coefficients other than `free` from the fit.
void hold_others(Candidate& candidate, const std::vector<std::string>& free) {
  for (stability::Parameter& p : candidate.info.linear) {
    if (std::find(free.begin(), free.end(), p.name) == free.end()) p.lower = p.upper = 0;
  }
}

/// Lets the shape parameters `free` move, by about kReach if they are near zero; fixes the others.
void free_shape(Candidate& candidate, const std::vector<std::string>& free) {
  for (std::size_t i = 0; i < candidate.info.shape.size(); ++i) {
    stability::Parameter& p = candidate.info.shape[i];
    const double value = candidate.thetas[0][i];
    p.value = value;
    if (std::find(free.begin(), free.end(), p.name) == free.end())
      p.lower = p.upper = value;
    else
      p.grid = {value, std::max(std::abs(value), kReach)};
  }
}

std::vector<Candidate> steps_in_time(const Formula& formula, Candidate candidate) {
  const auto at_s = first_of(formula, {"at", "middle"});
  if (!is_vertical(formula) || !at_s) return {};
  candidate.thetas.clear();
  for (const double off_s : {-0.4, -0.2, -0.1, 0.0, 0.1, 0.2, 0.4})
    candidate.thetas.push_back({std::max(*at_s + off_s, 0.0)});
  // A jump has no derivative with respect to its time, so the best of these times is kept.
  candidate.info.shape[0].lower = candidate.info.shape[0].upper = *at_s;
  return {std::move(candidate)};
}

std::vector<Candidate> shear_layers(const Formula& formula, Candidate candidate) {
  const auto height_m = first_of(formula, {"middle", "at", "centre"});
  if (!is_horizontal(formula) || !height_m) return {};
  const double width_m = number_of(formula, "width").value_or(0.1);
  std::vector<double> theta = candidate.thetas[0];
  candidate.thetas.clear();
  theta[0] = *height_m;
  for (const double factor : {1.0, 0.4, 2.0}) {
    theta[1] = std::max(factor * width_m, 0.02);
    candidate.thetas.push_back(theta);
  }
  hold_others(candidate, {"shear_x_N", "shear_y_N"});
  free_shape(candidate, {"height_m", "thickness_m"});
  return {std::move(candidate)};
}

std::vector<Candidate> thermals(const Formula& formula, Candidate candidate) {
  const auto x_m = number_of(formula, "x_centre"), y_m = number_of(formula, "y_centre");
  const auto radius_m = first_of(formula, {"width", "core"});
  const bool is_column = formula.form == "gaussian" || formula.form == "inverse_square";
  if (!is_vertical(formula) || !is_column || !x_m || !y_m || !radius_m) return {};
  std::vector<double> theta = candidate.thetas[0];
  theta[2] = *x_m;
  theta[3] = *y_m;
  theta[4] = *radius_m;
  candidate.thetas = {theta};
  hold_others(candidate, {"thermal_N"});
  free_shape(candidate, {"x_m", "y_m", "radius_m"});
  return {std::move(candidate)};
}

/// Range for a position from a formula: half the flown range beyond both of its ends (forms.cpp).
struct FlownRange {
  double lower_m, upper_m, at_m;
  double span_m() const { return upper_m - lower_m; }
};

/// Returns the range for the formula's first position; for a decay without one, its end of the range plus a length.
std::optional<FlownRange> range_of_place(const Formula& formula) {
  for (const auto& [name, bounds] : formula.effect.expression.bounds) {
    const bool is_place = name == "centre_m" || name == "middle_m" || name == "at_m" || name == "from_m";
    if (!is_place || !(bounds.lower < bounds.upper)) continue;
    const double span_m = 0.5 * (bounds.upper - bounds.lower);
    return FlownRange{bounds.lower + 0.5 * span_m, bounds.upper - 0.5 * span_m,
                      formula.effect.parameters.at(name)};
  }
  const auto from_m = number_of(formula, "from"), length_m = number_of(formula, "length");
  if (!from_m || !length_m) return std::nullopt;
  const double span_m = 5 * *length_m;
  if (formula.form == "growth") return FlownRange{*from_m - span_m, *from_m, *from_m};
  return FlownRange{*from_m, *from_m + span_m, *from_m};
}

/// Returns walls for a force along x that is concentrated at one end of the flown range of x, and likewise for y.
/// Nothing flies beyond a wall: it is at that end, or where the formula has its position.
std::vector<Candidate> walls(const Formula& formula, Candidate candidate) {
  const bool is_x = formula.variable == "x";
  const auto range = range_of_place(formula);
  if (!acts_along(formula, {is_x ? "force_x_N" : "force_y_N"}) || !range) return {};
  const double middle_m = 0.5 * (range->lower_m + range->upper_m);
  const bool is_above = range->at_m > middle_m;
  const double end_m = is_above ? range->upper_m : range->lower_m;
  const double bearing = is_x ? (is_above ? 0 : kPi) : (is_above ? 0.5 : -0.5) * kPi;
  candidate.thetas.clear();
  for (const double place_m : {end_m, range->at_m}) {
    for (const double share : {0.06, 0.1, 0.15, 0.25})
      candidate.thetas.push_back({bearing, is_above ? place_m : -place_m, share * range->span_m()});
    if (range->at_m == end_m) break;
  }
  free_shape(candidate, {"decay_m"});
  return {std::move(candidate)};
}

/// Returns tethers anchored below the middle of the flown range, which the fit then moves.
std::vector<Candidate> tethers(const Formula& formula, Candidate candidate) {
  const auto range = range_of_place(formula);
  const double middle_m = range ? 0.5 * (range->lower_m + range->upper_m) : 0;
  const double x_m = number_of(formula, "x_centre").value_or(formula.variable == "x" ? middle_m : 0);
  const double y_m = number_of(formula, "y_centre").value_or(formula.variable == "y" ? middle_m : 0);
  candidate.thetas.clear();
  for (const double z_m : {0.0, 0.8}) {
    for (const double slack_m : {0.2, 0.4, 0.6, 0.9, 1.2})
      candidate.thetas.push_back({x_m, y_m, z_m, slack_m});
  }
  free_shape(candidate, {"anchor_x_m", "anchor_y_m", "anchor_z_m", "slack_m"});
  return {std::move(candidate)};
}

std::vector<Candidate> tilts(const Formula&, Candidate candidate) { return {std::move(candidate)}; }

std::vector<Candidate> vortex_rings(const Formula& formula, Candidate candidate) {
  if (!is_vertical(formula)) return {};
  const auto at_m_s = first_of(formula, {"centre"}), width_m_s = first_of(formula, {"width", "core"});
  if (at_m_s && width_m_s && *at_m_s < 0) candidate.thetas.push_back({-*at_m_s, *width_m_s});
  return {std::move(candidate)};
}

std::vector<Candidate> on_its_grid(const Formula& formula, Candidate candidate) {
  if (!is_vertical(formula)) return {};
  return {std::move(candidate)};
}

/// Also starts at the thrust above which the formula's force acts, which may be close to hover.
void start_at_knee(const Formula& formula, double weight_N, Candidate& candidate) {
  const auto from_N = number_of(formula, "from");
  if (formula.variable != "thrust" || formula.form != "above" || !from_N) return;
  const double lowest = candidate.info.shape[0].lower;
  candidate.thetas.push_back({std::max(*from_N / weight_N, lowest)});
}

/// An effect and the variables that suggest it.
struct NamedForm {
  const char* effect;
  std::vector<std::string> variables;
  std::vector<Candidate> (*make)(const Formula&, Candidate);
};

const std::vector<NamedForm>& all_forms() {
  static const std::vector<NamedForm> forms = {
      {"voltage_sag", {"thrust", "duty_1", "duty_2", "duty_3", "duty_4"}, on_its_grid},
      {"thrust_saturation", {"thrust", "duty_1", "duty_2", "duty_3", "duty_4"}, on_its_grid},
      {"payload_step", {"time"}, steps_in_time},
      {"translational_lift", {"speed", "airspeed"}, on_its_grid},
      {"wind_field", {"z"}, shear_layers},
      {"wind_field", {"xy"}, thermals},
      {"wall", {"x", "y"}, walls},
      {"tether", {"x", "y", "z", "xy"}, tethers},
      {"imu_tilt", {"body_constant"}, tilts},
      {"vortex_ring", {"vz", "climb"}, vortex_rings}};
  return forms;
}

bool is_same(const Candidate& a, const Candidate& b) { return a.name == b.name && a.thetas == b.thetas; }

}  // namespace

bool needs_scan(const std::string& effect) {
  return std::any_of(all_forms().begin(), all_forms().end(),
                     [&](const NamedForm& form) { return effect == form.effect; });
}

bool points_to(const std::string& variable, const std::string& effect) {
  return std::any_of(all_forms().begin(), all_forms().end(), [&](const NamedForm& form) {
    return effect == form.effect &&
           std::find(form.variables.begin(), form.variables.end(), variable) != form.variables.end();
  });
}

std::vector<Candidate> named_forms(const std::vector<Formula>& formulas, const stability::Model& model,
                                   const Coverage& coverage) {
  std::vector<Candidate> all;
  for (const Formula& formula : formulas) {
    for (const NamedForm& form : all_forms()) {
      const auto& names = form.variables;
      const bool has_it = std::any_of(model.effects.begin(), model.effects.end(),
                                      [&](const auto& spec) { return spec.name == form.effect; });
      if (has_it || std::find(names.begin(), names.end(), formula.variable) == names.end()) continue;
      for (Candidate& next : form.make(formula, candidate(form.effect, model, coverage))) {
        if (next.name == "thrust_saturation") start_at_knee(formula, model.weight_N(), next);
        const bool is_known =
            std::any_of(all.begin(), all.end(), [&](const Candidate& other) { return is_same(other, next); });
        if (!is_known) all.push_back(std::move(next));
      }
    }
  }
  return all;
}

}  // namespace swarmcert::identification
