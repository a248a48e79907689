#include <algorithm>
#include <cmath>

#include "stability/sweep/grid.h"

namespace swarmcert::stability {
namespace {

/// The loop of a cell, and how many neighbours multiply the disturbance.
struct Variant {
  FlownLoop loop;
  double neighbours = 1;
};

Variant variant_of(const Grid& grid, const std::vector<double>& values) {
  Variant v = {{grid.gains, {}}, 1};
  Gains& gains = v.loop.gains;
  Plant& plant = v.loop.plant;
  const auto i = static_cast<std::size_t>(grid.axis);
  double battery_V = kFullBattery_V;
  plant.mass_kg = plant.told_mass_kg = grid.model.mass_kg;
  // A loop without a step of its own adds one period per period, whatever its rate.
  bool own_step = gains.rate_hz > 0 && std::abs(v.loop.integral_share() - 1) > 1e-12;
  for (std::size_t k = 0; k < values.size(); ++k) {
    const std::string& name = grid.axes[k].name;
    const double value = values[k];
    if (name == "Kp") gains.pid->Kp_1_s2[i] = value;
    if (name == "Kd") gains.pid->Kd_1_s[i] = value;
    if (name == "Ki") gains.pid->Ki_1_s3[i] = value;
    if (name == "Lambda") gains.composite->Lambda_1_s[i][i] = value;
    if (name == "K") gains.composite->K_kg_s[i][i] = value;
    if (name == "mass_kg") plant.mass_kg = value;
    if (name == "thrust_scale") plant.thrust_scale = value;
    if (name == "battery_V") battery_V = value;
    if (name == "motor_s") gains.motor_lag_s = value;
    if (name == "attitude_s") gains.attitude_lag_s = value;
    if (name == "delay_s") gains.delay_s = value;
    if (name == "rate_hz") gains.rate_hz = value;
    if (name == "integrator_step_s") gains.integrator_step_s = value, own_step = true;
    if (name == "neighbours") v.neighbours = value;
    if (name == "vehicles") v.neighbours = std::max(0.0, value - 1);
  }
  if (gains.rate_hz > 0 && !own_step) gains.integrator_step_s = 1 / gains.rate_hz;
  plant.largest_thrust_N = grid.model.largest_thrust_N(battery_V);
  plant.least_thrust_N =
      static_cast<double>(grid.model.num_rotors()) * least_rotor_force_N(grid.model.thrust);
  return v;
}

/// Computes each requested quantity of the loop that flies, at most once.
class Quantities {
 public:
  Quantities(const Grid& grid, const Variant& variant)
      : axis_(grid.axis),
        loop_(variant.loop),
        continuous_(*loop_.continuous(axis_)),
        sampled_(loop_.sampled(axis_)) {
    source_.kind = "declared";
    for (int axis = 0; axis < 3; ++axis) {
      Disturbance& d = source_.axis[axis];
      if (axis != axis_) {
        d.amplitude_N = d.rate_N_s = d.variation_N = d.impulse_N_s = 0;
        continue;
      }
      d = grid.disturbance;
      for (double* const known : {&d.amplitude_N, &d.rate_N_s, &d.variation_N, &d.impulse_N_s})
        if (std::isfinite(*known)) *known *= variant.neighbours;
    }
  }

  double operator()(const std::string& name) {
    if (name == "rate") return gains().all_times.rate;
    if (name == "amplitude") return gains().all_times.amplitude;
    if (name == "edge") return gains().all_times.edge;
    if (name == "impulse") return gains().all_times.impulse;
    if (name == "error_m") return axis_bounds(loop_, gains(), source_, {}).least();
    if (name == "lag_limit_s") return lag_limit(continuous_);
    if (name == "delay_limit_s") return delay_limit(continuous_);
    if (name == "lag_floor") return lag_floor(continuous_).rate;
    if (name == "effort") return sampled_ ? effort_gain(*sampled_) : effort_gain(continuous_);
    if (name == "noise_command_m_s2") return sampled_ ? noise().command_m_s2 : NAN;
    if (name == "noise_error_m") return sampled_ ? noise().error_m : NAN;
    if (name == "spectral_radius") return sampled_ ? spectral_radius(*sampled_) : NAN;
    if (name == "integral_authority_N")
      return continuous_.Ki > 0 ? continuous_.mass_kg * continuous_.Ki * loop_.integral_limit_m_s(axis_) : 0;
    return thrust().margin_N();
  }

  /// Saturation under [disturbance], of this axis alone.
  const Saturation& thrust() {
    if (!thrust_) thrust_ = thrust_demand(loop_, source_, {});
    return *thrust_;
  }

 private:
  const ExactGains& gains() {
    if (gains_) return *gains_;
    gains_ = {axis_, Channel::kForce, Loop::kContinuous, {}, {}};
    if (sampled_) gains_->loop = Loop::kSampled;
    gains_->all_times = sampled_ ? sampled_norms(*sampled_, Channel::kForce, Instants::kAll)
                                 : continuous_norms(continuous_, Channel::kForce);
    return *gains_;
  }
  const NoiseDeviation& noise() {
    if (!noise_) noise_ = noise_deviation(*sampled_, 1e-3, 0.05);
    return *noise_;
  }

  int axis_;
  FlownLoop loop_;
  AxisLoop continuous_;
  std::optional<SampledLoop> sampled_;
  DisturbanceSource source_;
  std::optional<ExactGains> gains_;
  std::optional<NoiseDeviation> noise_;
  std::optional<Saturation> thrust_;
};

std::string limit_text(const GridLimit& limit, double value) {
  if (std::isnan(value)) return limit.quantity + " is undefined";
  const bool is_below = value < limit.least;
  return limit.quantity + (is_below ? " is below " : " is above ") +
         decimals(is_below ? limit.least : limit.most) + ": " + decimals(value);
}

/// Returns an empty text if the rotors can lift the vehicle.
std::string lift_text(const FlownLoop& loop) {
  const double weight_N = loop.plant.mass_kg * kGravity_m_s2, most_N = loop.thrust_range_N().upper;
  if (most_N > weight_N) return "";
  return "the rotors cannot lift the vehicle: " + decimals(most_N) + " N of thrust for " +
         decimals(weight_N) + " N of weight";
}

}  // namespace

Cell compute_cell(const Grid& grid, long index) {
  Cell cell;
  cell.index = index;
  cell.values.assign(grid.compute.size(), NAN);
  const Variant variant = variant_of(grid, grid.at(index));
  const FlownLoop& loop = variant.loop;
  const std::optional<AxisLoop> continuous = loop.continuous(grid.axis);
  if (!continuous) {
    cell.infeasible = "Lambda or K couples axes";
    return cell;
  }
  const std::optional<SampledLoop> sampled = loop.sampled(grid.axis);
  if (sampled ? !(spectral_radius(*sampled) < 1) : !is_stable(*continuous)) {
    cell.infeasible = sampled ? "the sampled loop is unstable" : "the continuous loop is unstable";
    return cell;
  }
  cell.infeasible = lift_text(loop);
  Quantities quantities(grid, variant);
  for (std::size_t i = 0; i < grid.compute.size(); ++i) cell.values[i] = quantities(grid.compute[i]);
  // All bounds assume that thrust never reaches its limit.
  if (cell.infeasible.empty() && std::isfinite(grid.disturbance.amplitude_N)) {
    const Saturation& thrust = quantities.thrust();
    if (!thrust.is_proved())
      cell.infeasible = "the thrust is not proved to suffice under the disturbance: up to " +
                        decimals(-thrust.margin_N()) + " N short";
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
