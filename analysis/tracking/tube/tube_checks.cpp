#include "analysis/tracking/tube/tube_checks.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "nn/base/doubles.h"
#include "stability/bounds/enclosures/interval_functions.h"

namespace swarmcert::analysis {

namespace {

constexpr double kGravity_m_s2 = stability::kGravity_m_s2;
/// Distance from which neighbours are faded out in flight (controller::CutOffs): 1 m less 0.1 m.
constexpr double kFade_m = 0.9;

double largest(const std::vector<double>& values) { return *std::max_element(values.begin(), values.end()); }

double length(Interval x, Interval y, Interval z) {
  using stability::square;
  return sqrt(square(x) + square(y) + square(z)).upper;
}

/// a x, where a factor of 0 takes precedence over an unknown one.
double times(double a, double x) { return a == 0 || x == 0 ? 0 : up(a * x); }

/// Bounds on one vehicle's loop that follow from the tube.
struct Loads {
  double integral_m_s[3] = {0, 0, 0};  ///< sup |int e|
  double command_N[3] = {0, 0, 0};     ///< sup of the commanded force, without gravity
};

/// Bounds on the signals of one axis of one vehicle, per slice.
struct AxisLoads {
  std::vector<double> error_N;       ///< force that is not modelled, including that of the held command
  std::vector<double> truth_N;       ///< sup of the true force
  std::vector<double> lagged_N;      ///< sup of the signal behind the lags
  std::vector<double> planned_m_s2;  ///< sup of the planned acceleration
  std::vector<double> jerk_m_s3;
  LoopHistory met;
  double hold_N = 0;  ///< largest contribution of the held command to error_N
};

/// Contribution of the integrator's steps to the integral of an error of the estimated position.
double stepped_m_s(const Scene& scene, std::size_t axis) {
  return up(scene.loops().axis[axis].period_s * scene.estimates().position_m[axis]);
}

/// Contribution of errors of the estimated velocity, and of the integrator's steps with errors of the position, to
/// the command.
double estimate_error_N(const Scene& scene, std::size_t axis) {
  const ErrorLoop& loop = scene.loops().axis[axis];
  return up(scene.tracking().plant.mass_kg * up(times(loop.Kd, scene.estimates().velocity_m_s[axis]) +
                                                times(loop.Ki, stepped_m_s(scene, axis))));
}

AxisLoads axis_loads(const Scene& scene, const SlicedTube& tube, std::size_t i, std::size_t axis) {
  const Motion& motion = scene.motion();
  const double mass_kg = scene.tracking().plant.mass_kg;
  const double estimate_N = estimate_error_N(scene, axis);
  AxisLoads result;
  result.hold_N = largest(tube.hold_N[i][axis]);
  for (std::size_t n = 0; n < tube.slices.size(); ++n) {
    const Stretch& stretch = motion.stretches[static_cast<std::size_t>(motion.stretch_of[i][n])];
    const Deviation& one = tube.slices[n][i];
    result.truth_N.push_back(tube.truth[i][n][axis].mag());
    const double unmodelled_N = axis == 2 ? tube.force_error_N[i][n].mag() : result.truth_N.back();
    result.error_N.push_back(up(up(unmodelled_N + tube.hold_N[i][axis][n]) + estimate_N));
    result.met.add(
        scene.in_slice(static_cast<int>(n), one.position_m[axis].mag(), one.velocity_m_s[axis].mag()));
    result.planned_m_s2.push_back(stretch.acceleration_m_s2[axis].mag());
    result.jerk_m_s3.push_back(stretch.jerk_m_s3[axis].mag());
    result.lagged_N.push_back(up(result.truth_N.back() + up(mass_kg * result.planned_m_s2.back())));
  }
  return result;
}

/// A lag averages over the past: it changes w by at most its time constants times sup |w'|, or by twice sup |w|.
double lag_error_N(const ErrorLoop& loop, const AxisLoads& acting, double mass_kg) {
  if (!loop.has_lag) return 0;
  const bool starts_at_rest = acting.planned_m_s2.front() < 1e-6;
  const double by_jerk =
      starts_at_rest ? up(up(loop.lags_s.upper * largest(acting.jerk_m_s3)) + 1e-6) : kInfinity;
  return up(2 * largest(acting.truth_N) + up(mass_kg * std::min(2 * largest(acting.planned_m_s2), by_jerk)));
}

/// Bound of the feedforward force along z, f_hat = f_a + (f_hat - f_a).
double fed_forward_N(const SlicedTube& tube, std::size_t i) {
  double fed_N = 0;
  for (std::size_t n = 0; n < tube.slices.size(); ++n)
    fed_N = std::max(fed_N, up(tube.truth[i][n][2].mag() + tube.force_error_N[i][n].mag()));
  return fed_N;
}

Loads loads(const Scene& scene, const SlicedTube& tube, int vehicle) {
  Loads result;
  const double mass_kg = scene.tracking().plant.mass_kg;
  const auto i = static_cast<std::size_t>(vehicle);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const ErrorLoop& loop = scene.loops().axis[axis];
    const AxisLoads acting = axis_loads(scene, tube, i, axis);
    double& integral_m_s = result.integral_m_s[axis];
    // int e = h * (f_a - f_hat + m x) + g * w
    if (loop.h) integral_m_s = largest(convolved(*loop.h, acting.error_N));
    if (loop.g && loop.Ki > 0) integral_m_s = up(integral_m_s + largest(convolved(*loop.g, acting.lagged_N)));
    // The integrator sums the estimated position.
    const double position_error_m = scene.estimates().position_m[axis];
    const double velocity_error_m_s = scene.estimates().velocity_m_s[axis];
    if (loop.demand && position_error_m > 0)
      integral_m_s =
          up(integral_m_s + up(times(loop.demand->total(), position_error_m) + stepped_m_s(scene, axis)));
    // An initial excess of the rotors adds exp(-t/tau) times the excess to the force.
    const double excess_N = axis == 2 ? scene.excess_at_start_N(vehicle).mag() : 0;
    if (loop.h && loop.has_lag)
      integral_m_s = up(integral_m_s + times(up(excess_N * loop.lags_s.upper), loop.h->peak));
    // A held command differs from that of the continuous law by x.
    const double feedback = up(
        up(acting.hold_N / mass_kg) + times(loop.Kp, up(acting.met.position_m + position_error_m)) +
        up(times(loop.Kd, up(acting.met.velocity_m_s + velocity_error_m_s)) + times(loop.Ki, integral_m_s)));
    const double lag_N = lag_error_N(loop, acting, mass_kg);
    const double acceleration_m_s2 =
        up(feedback + up(up(up(largest(acting.error_N) + lag_N) + excess_N) / mass_kg));
    integral_m_s = up(integral_m_s + sum_excess_m_s(loop, acting.met, acceleration_m_s2));
    const double fed_N = axis == 2 ? fed_forward_N(tube, i) : 0;
    result.command_N[axis] = up(up(mass_kg * up(feedback + largest(acting.planned_m_s2))) + fed_N);
  }
  return result;
}

/// Withdraws the proof if an integrator could reach its limit.
void check_integrators(const Scene& scene, const Loads& loads, LocalTube& tube) {
  const stability::Gains& gains = scene.tracking().gains;
  const double share = gains.rate_hz > 0 ? up(gains.integrator_step_s * gains.rate_hz) : 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double limit_m_s = gains.integrator_limit_m_s[axis];
    const double demand_m_s = up(share * loads.integral_m_s[axis]);
    if (scene.loops().axis[axis].Ki > 0 && !(demand_m_s <= limit_m_s) && tube.proved) {
      tube.proved = false;
      tube.why = fmt::format(
          "the integrator of axis {} could reach {:.3g} m s, beyond its limit of {:.3g} m s, where this loop "
          "no longer applies",
          stability::axis_name(static_cast<int>(axis)), demand_m_s, limit_m_s);
    }
  }
}

/// Demand on the rotors of the vehicles.
struct ThrustUse {
  double command_N = 0;  ///< the largest command
  bool is_kept = true;   ///< no command saturates or points downward
};

ThrustUse thrust_use(const stability::Plant& plant, const std::vector<Loads>& all) {
  ThrustUse use;
  use.is_kept = plant.largest_thrust_N > 0;
  const double weight_N = up(plant.mass_kg * kGravity_m_s2);
  for (const Loads& one : all) {
    use.command_N =
        std::max(use.command_N, length(one.command_N[0], one.command_N[1], up(weight_N + one.command_N[2])));
    use.is_kept = use.is_kept && use.command_N <= plant.largest_thrust_N &&
                  one.command_N[2] < plant.mass_kg * kGravity_m_s2;
  }
  return use;
}

/// Whether no neighbour is ever so far away that it is faded out.
bool neighbours_are_near(const Scene& scene, const Deviations& deviations) {
  for (const Stretch& stretch : scene.motion().stretches) {
    const std::vector<Interval> states = scene.seen_states(stretch, deviations);
    for (int n = 0; n + 1 < scene.vehicles(); ++n) {
      for (std::size_t k = 0; k < 3; ++k)
        if (!(states[static_cast<std::size_t>(n * kPerNeighbour) + k].mag() <= kFade_m)) return false;
    }
  }
  return true;
}

void add_assumptions(const Scene& scene, const ThrustUse& thrust, bool near, LocalTube& tube) {
  const stability::FlownLoop& tracking = scene.tracking();
  const stability::Gains& gains = tracking.gains;
  const auto add = [&tube](const char* name, const char* status, const std::string& note) {
    tube.assumptions.push_back({name, status, note});
  };
  add("the force is that of the declared truth", "assumed",
      scene.residual() == nullptr
          ? "enclosed at every state of the tube"
          : "and a residual within the ranges measured in flights by the neighbour's position");
  if (scene.loops().is_sampled()) {
    add("sampled position loop, axes apart, first-order lags", "assumed",
        fmt::format("the hold of the command over {:.3g} s and the integrator's steps are in the bounds; the "
                    "tilt of the thrust is left out",
                    scene.loops().axis[2].period_s));
  } else {
    add("continuous position loop, axes apart, first-order lags", "assumed",
        gains.rate_hz > 0 ? "sampling and the tilt of the thrust are left out"
                          : "the gains state no rate; the tilt of the thrust is left out");
  }
  if (scene.has_lag_interval()) {
    add("each vehicle's motors lag by a constant within an interval", "assumed",
        fmt::format("{:.4g} to {:.4g} s, whatever [lag] and the truth state", scene.motor_lag_s().lower,
                    scene.motor_lag_s().upper));
  } else if (scene.truth().motor_lag_s() > 0) {
    add("motors lag as stated by the truth", "assumed",
        fmt::format("{:.3g} s, whatever [lag] states", gains.motor_lag_s));
  }
  add("all vehicles have these gains and this model", "assumed", "and start at rest at their set points");
  if (scene.loops().axis[2].has_lag) {
    double excess_N = 0;
    for (int i = 0; i < scene.vehicles(); ++i)
      excess_N = std::max(excess_N, scene.excess_at_start_N(i).mag());
    add("rotors start between the weight and the force that the first prediction requests", "assumed",
        fmt::format("at most {:.3g} N away from the weight", excess_N));
  }
  if (scene.estimates().are_zero()) {
    add("exact position and velocity", "assumed", "also of neighbours, known from the start");
  } else {
    const EstimateErrors& e = scene.estimates();
    add("errors of the estimates stay within their bounds", "assumed",
        fmt::format("velocity {:.3g}, {:.3g}, {:.3g} m/s, position {:.3g}, {:.3g}, {:.3g} m, of any course; "
                    "the same for the states passed to the network, of the vehicle and of its neighbours",
                    e.velocity_m_s[0], e.velocity_m_s[1], e.velocity_m_s[2], e.position_m[0], e.position_m[1],
                    e.position_m[2]));
  }
  add("predictions are a staircase", "proved",
      fmt::format("states up to {:.3g} s old are in the bounds", scene.network_age_s()));
  add("the integrator stays within its limit", tube.proved ? "proved" : "assumed", "");
  add("no saturation of the thrust", thrust.is_kept ? "proved" : "assumed",
      fmt::format("commands of at most {:.3g} N, of {:.3g} N", thrust.command_N,
                  tracking.plant.largest_thrust_N));
  add("neighbours count fully", near ? "proved" : "assumed",
      "within 0.9 m along each axis, where none is faded out");
}

/// Counts the cells of the residual that vehicles can reach.
void count_residual_cells(const Scene& scene, LocalTube& tube) {
  if (scene.residual() == nullptr) return;
  const std::vector<ResidualEnvelope::Cell>& cells = scene.residual()->cells;
  std::vector<char> is_reached(cells.size(), 0);
  const Motion& motion = scene.motion();
  for (const std::vector<int>& of_vehicle : motion.stretch_of) {
    for (std::size_t n = 0; n < of_vehicle.size(); ++n) {
      const std::vector<Interval> states =
          scene.states(motion.stretches[static_cast<std::size_t>(of_vehicle[n])], tube.sliced.slices[n]);
      for (const std::size_t cell : scene.residual()->reached(scene.offsets(states, states)))
        is_reached[cell] = 1;
    }
  }
  for (std::size_t i = 0; i < cells.size(); ++i) {
    tube.residual_cells += is_reached[i];
    if (cells[i].flights == 0) tube.residual_cells_without_flights += is_reached[i];
  }
}

}  // namespace

void check_tube(const Scene& scene, LocalTube& tube) {
  std::vector<Loads> all;
  for (int i = 0; i < scene.vehicles(); ++i) {
    all.push_back(loads(scene, tube.sliced, i));
    check_integrators(scene, all.back(), tube);
  }
  tube.whole = tube.sliced.whole();
  count_residual_cells(scene, tube);
  add_assumptions(scene, thrust_use(scene.tracking().plant, all), neighbours_are_near(scene, tube.whole),
                  tube);
}

}  // namespace swarmcert::analysis
