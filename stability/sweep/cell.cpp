#include <algorithm>
#include <cmath>
#include <map>

#include "nn/base/doubles.h"
#include "stability/sweep/grid.h"

namespace swarmcert::stability {
namespace {

/// The grid's gains and vehicle with a cell's values inserted.
struct Variant {
  Gains gains;
  Plant plant;
  double neighbours = 1;
};

Variant variant_of(const Grid& grid, const std::vector<double>& values) {
  Variant v = {grid.gains, {}, 1};
  const auto i = static_cast<std::size_t>(grid.axis);
  double battery_V = kFullBattery_V;
  v.plant.mass_kg = grid.model.mass_kg;
  bool own_step = std::abs(grid.gains.integrator_step_s * grid.gains.rate_hz - 1) > 1e-12;
  for (std::size_t k = 0; k < values.size(); ++k) {
    const std::string& name = grid.axes[k].name;
    const double value = values[k];
    if (name == "Kp") v.gains.pid->Kp_1_s2[i] = value;
    if (name == "Kd") v.gains.pid->Kd_1_s[i] = value;
    if (name == "Ki") v.gains.pid->Ki_1_s3[i] = value;
    if (name == "Lambda") v.gains.composite->Lambda_1_s[i][i] = value;
    if (name == "K") v.gains.composite->K_kg_s[i][i] = value;
    if (name == "mass_kg") v.plant.mass_kg = value;
    if (name == "thrust_scale") v.plant.thrust_scale = value;
    if (name == "battery_V") battery_V = value;
    if (name == "motor_s") v.gains.motor_lag_s = value;
    if (name == "attitude_s") v.gains.attitude_lag_s = value;
    if (name == "delay_s") v.gains.delay_s = value;
    if (name == "rate_hz") v.gains.rate_hz = value;
    if (name == "integrator_step_s") v.gains.integrator_step_s = value, own_step = true;
    if (name == "neighbours") v.neighbours = value;
    if (name == "vehicles") v.neighbours = std::max(0.0, value - 1);
  }
  if (v.gains.rate_hz > 0 && !own_step) v.gains.integrator_step_s = 1 / v.gains.rate_hz;
  v.plant.largest_thrust_N = v.plant.thrust_scale * grid.model.largest_thrust_N(battery_V);
  // The firmware commands forces for the mass it was told, so another mass scales the effect of its gains.
  v.plant.thrust_scale *= grid.model.mass_kg / v.plant.mass_kg;
  return v;
}

/// Computes each requested quantity, at most once.
class Quantities {
 public:
  Quantities(const Grid& grid, const Variant& variant, const AxisLoop& loop,
             const std::optional<SampledLoop>& sampled)
      : grid_(grid), variant_(variant), loop_(loop), acting_(loop), sampled_(sampled) {
    if (sampled_) acting_.Ki = effective_Ki(*sampled_);
  }

  double operator()(const std::string& name) {
    if (name == "rate") return norms().rate;
    if (name == "amplitude") return norms().amplitude;
    if (name == "edge") return norms().edge;
    if (name == "impulse") return norms().impulse;
    if (name == "error_m") return error();
    if (name == "lag_limit_s") return lag_limit(acting_);
    if (name == "delay_limit_s") return delay_limit(acting_);
    if (name == "lag_floor") return lag_floor(acting_).rate;
    if (name == "effort") return effort();
    if (name == "noise_command_m_s2") return sampled_ ? noise().command_m_s2 : NAN;
    if (name == "noise_error_m") return sampled_ ? noise().error_m : NAN;
    if (name == "spectral_radius") return sampled_ ? spectral_radius(*sampled_) : NAN;
    if (name == "integral_authority_N") {
      return loop_.Ki > 0 ? loop_.mass_kg * loop_.Ki *
                                variant_.gains.integrator_limit_m_s[static_cast<std::size_t>(grid_.axis)]
                          : 0;
    }
    const double weight_N = grid_.axis == 2 ? variant_.plant.mass_kg * kGravity_m_s2 : 0;
    return variant_.plant.largest_thrust_N - weight_N - effort() * scaled(grid_.disturbance.amplitude_N);
  }

 private:
  double scaled(double known) const { return std::isinf(known) ? known : variant_.neighbours * known; }

  /// Norms of the loop as flown, with the effective integral gain.
  const GainNorms& norms() {
    if (!norms_) norms_ = continuous_norms(acting_, Channel::kForce);
    return *norms_;
  }
  double error() {
    const Disturbance& d = grid_.disturbance;
    Disturbance all = d;
    all.amplitude_N = scaled(d.amplitude_N);
    all.impulse_N_s = scaled(d.impulse_N_s);
    all.rate_N_s = scaled(d.rate_N_s);
    all.variation_N = scaled(d.variation_N);
    const double share = sampled_ ? sampled_->integrator_step_s / sampled_->period_s : 1;
    const ClampBounds clamp =
        clamp_bounds(acting_, Channel::kForce, all, {},
                     variant_.gains.integrator_limit_m_s[static_cast<std::size_t>(grid_.axis)], share);
    // If the integrator may reach its clamp, the loop is not linear.
    if (clamp.exists && !clamp.never_acts) return std::min(clamp.by_amplitude, clamp.by_impulse);
    const auto bound = [](double gain, double known) { return std::isinf(known) ? kInfinity : gain * known; };
    return std::min({bound(norms().rate, scaled(d.rate_N_s)), bound(norms().amplitude, scaled(d.amplitude_N)),
                     bound(norms().edge, scaled(d.variation_N)),
                     bound(norms().impulse, scaled(d.impulse_N_s))});
  }
  double effort() {
    if (!effort_) effort_ = effort_gain(acting_);
    return *effort_;
  }
  const NoiseDeviation& noise() {
    if (!noise_) noise_ = noise_deviation(*sampled_, 1e-3, 0.05);
    return *noise_;
  }

  const Grid& grid_;
  const Variant& variant_;
  const AxisLoop& loop_;
  AxisLoop acting_;  ///< with the effective integral gain of the sampled loop
  const std::optional<SampledLoop>& sampled_;
  std::optional<GainNorms> norms_;
  std::optional<double> effort_;
  std::optional<NoiseDeviation> noise_;
};

std::string limit_text(const GridLimit& limit, double value) {
  char text[160];
  if (value < limit.least) {
    std::snprintf(text, sizeof text, "%s %.4g is below %.4g", limit.quantity.c_str(), value, limit.least);
  } else {
    std::snprintf(text, sizeof text, "%s %.4g is above %.4g", limit.quantity.c_str(), value, limit.most);
  }
  return text;
}

/// Returns an empty text if the rotors can lift the vehicle.
std::string lift_text(const Variant& variant) {
  const double weight_N = variant.plant.mass_kg * kGravity_m_s2;
  if (variant.plant.largest_thrust_N > weight_N) return "";
  char text[160];
  std::snprintf(text, sizeof text,
                "the rotors cannot lift the vehicle: %.4g N of thrust for %.4g N of weight",
                variant.plant.largest_thrust_N, weight_N);
  return text;
}

std::string thrust_text(double margin_N) {
  char text[160];
  std::snprintf(text, sizeof text, "the thrust is %.4g N short under the disturbance", -margin_N);
  return text;
}

}  // namespace

Cell compute_cell(const Grid& grid, long index) {
  Cell cell;
  cell.index = index;
  cell.values.assign(grid.compute.size(), NAN);
  const Variant variant = variant_of(grid, grid.at(index));
  const std::optional<AxisLoop> loop = axis_loop(variant.gains, variant.plant, grid.axis);
  if (!loop) {
    cell.infeasible = "Lambda or K couples axes";
    return cell;
  }
  if (!is_stable(*loop)) {
    cell.infeasible = "the continuous loop is unstable";
    return cell;
  }
  const std::optional<SampledLoop> sampled = sampled_axis_loop(variant.gains, variant.plant, grid.axis);
  if (sampled && !(spectral_radius(*sampled) < 1)) {
    cell.infeasible = "the sampled loop is unstable";
    return cell;
  }
  cell.infeasible = lift_text(variant);
  Quantities quantities(grid, variant, *loop, sampled);
  for (std::size_t i = 0; i < grid.compute.size(); ++i) cell.values[i] = quantities(grid.compute[i]);
  // All bounds assume that thrust never reaches its limit.
  if (cell.infeasible.empty() && std::isfinite(grid.disturbance.amplitude_N)) {
    const double margin_N = quantities("thrust_margin_N");
    if (margin_N < 0) cell.infeasible = thrust_text(margin_N);
  }
  for (const GridLimit& limit : grid.limits) {
    if (!cell.infeasible.empty()) break;
    const double value = quantities(limit.quantity);
    if (!(value >= limit.least && value <= limit.most)) {
      cell.infeasible = limit_text(limit, value);
      break;
    }
  }
  return cell;
}

std::vector<long> pareto_front(const Grid& grid, const std::vector<Cell>& cells) {
  std::vector<std::pair<std::size_t, int>> objectives;
  for (const std::string& name : grid.pareto) {
    const auto at = std::find(grid.compute.begin(), grid.compute.end(), name);
    for (const Quantity& quantity : grid_quantities()) {
      if (quantity.name == name) objectives.emplace_back(at - grid.compute.begin(), quantity.better);
    }
  }
  std::vector<long> front;
  if (objectives.empty()) return front;
  const auto costs = [&](const Cell& cell) {
    std::vector<double> result;
    for (const auto& [column, better] : objectives) result.push_back(-better * cell.values[column]);
    return result;
  };
  // In lexicographic order of costs, a cell can only be dominated by an earlier one.
  std::vector<std::pair<std::vector<double>, long>> order;
  for (const Cell& cell : cells) {
    std::vector<double> cost = costs(cell);
    const bool finite = std::all_of(cost.begin(), cost.end(), [](double c) { return !std::isnan(c); });
    if (cell.infeasible.empty() && finite) order.emplace_back(std::move(cost), cell.index);
  }
  std::sort(order.begin(), order.end());
  std::vector<const std::vector<double>*> kept;
  for (const auto& [cost, index] : order) {
    const bool is_beaten =
        std::any_of(kept.begin(), kept.end(), [&cost = cost](const std::vector<double>* other) {
          bool strictly = false;
          for (std::size_t i = 0; i < cost.size(); ++i) {
            if ((*other)[i] > cost[i]) return false;
            strictly = strictly || (*other)[i] < cost[i];
          }
          return strictly;
        });
    if (is_beaten) continue;
    kept.push_back(&cost);
    front.push_back(index);
  }
  std::sort(front.begin(), front.end());
  return front;
}

}  // namespace swarmcert::stability
