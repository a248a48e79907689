#include "analysis/tracking/tube/tube_checks.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace swarmcert::analysis {

namespace {

constexpr double kNotKnown = std::numeric_limits<double>::infinity();
constexpr double kGravity_m_s2 = stability::kGravity_m_s2;
/// Distance from which neighbours are faded out in flight (controller::CutOffs): 1 m less 0.1 m.
constexpr double kFade_m = 0.9;

double largest(const std::vector<double>& values) { return *std::max_element(values.begin(), values.end()); }

double length(Interval x, Interval y, Interval z) {
  const auto square = [](Interval a) { return abs(a) * abs(a); };
  return sqrt(square(x) + square(y) + square(z)).upper;
}

double length(const double (&x)[3]) { return length(x[0], x[1], x[2]); }

/// a x, where a factor of 0 takes precedence over an unknown one.
double times(double a, double x) { return a == 0 || x == 0 ? 0 : up(a * x); }

/// Bounds on one vehicle's loop that follow from the tube.
struct Loads {
  double integral_m_s[3] = {0, 0, 0};       ///< sup |int e|
  double acceleration_m_s2[3] = {0, 0, 0};  ///< sup |e''|
  double command_N[3] = {0, 0, 0};          ///< sup of the commanded force, without gravity
};

/// Bounds on the signals of one axis of one vehicle, per stretch.
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

AxisLoads axis_loads(const Scene& scene, const LocalTube& tube, int vehicle, std::size_t axis) {
  const Motion& motion = scene.motion();
  const double mass_kg = scene.tracking().plant.mass_kg;
  const auto i = static_cast<std::size_t>(vehicle);
  AxisLoads result;
  for (const int s : motion.stretch_of[i]) {
    const auto at = static_cast<std::size_t>(s);
    result.truth_N.push_back(tube.tube.truth[at].force_N[axis].mag());
    result.error_N.push_back(axis == 2 ? tube.tube.force_N[at] : result.truth_N.back());
    result.met.add(scene.in_slice(motion.stretches[at], motion.slices - 1, axis, result.error_N.back(),
                                  tube.tube.truth[at], tube.tube.radii.position_m[i][axis],
                                  tube.tube.radii.velocity_m_s[i][axis]));
    result.planned_m_s2.push_back(motion.stretches[at].acceleration_m_s2[axis].mag());
    result.jerk_m_s3.push_back(motion.stretches[at].jerk_m_s3[axis].mag());
    result.lagged_N.push_back(up(result.truth_N.back() + up(mass_kg * result.planned_m_s2.back())));
  }
  const std::vector<double> hold_by_slice_N =
      tube.sliced.proved
          ? tube.sliced.hold_N[i][axis]
          : std::vector<double>(result.error_N.size(), scene.hold_error_N(vehicle, axis, result.met));
  result.hold_N = largest(hold_by_slice_N);
  for (std::size_t n = 0; result.hold_N > 0 && n < result.error_N.size(); ++n)
    result.error_N[n] = up(result.error_N[n] + hold_by_slice_N[n]);
  const double estimate_N = estimate_error_N(scene, axis);
  for (double& error : result.error_N)
    if (estimate_N > 0) error = up(error + estimate_N);
  return result;
}

/// A lag averages over the past: it changes w by at most its time constants times sup |w'|, or by twice sup |w|.
double lag_error_N(const ErrorLoop& loop, const AxisLoads& acting, double mass_kg) {
  if (!loop.has_lag) return 0;
  const bool starts_at_rest = acting.planned_m_s2.front() < 1e-6;
  const double by_jerk =
      starts_at_rest ? up(up(loop.lags_s.upper * largest(acting.jerk_m_s3)) + 1e-6) : kNotKnown;
  return up(2 * largest(acting.truth_N) + up(mass_kg * std::min(2 * largest(acting.planned_m_s2), by_jerk)));
}

/// Bound of the feedforward force along z, f_hat = f_a + (f_hat - f_a).
double fed_forward_N(const LocalTube& tube, const std::vector<int>& stretches) {
  double fed_N = 0;
  for (const int s : stretches) {
    const auto at = static_cast<std::size_t>(s);
    fed_N = std::max(fed_N, up(tube.tube.truth[at].force_N[2].mag() + tube.tube.force_N[at]));
  }
  return fed_N;
}

Loads loads(const Scene& scene, const LocalTube& tube, int vehicle) {
  Loads result;
  const double mass_kg = scene.tracking().plant.mass_kg;
  const auto i = static_cast<std::size_t>(vehicle);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const ErrorLoop& loop = scene.loops().axis[axis];
    const AxisLoads acting = axis_loads(scene, tube, vehicle, axis);
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
    const double feedback =
        up(up(acting.hold_N / mass_kg) +
           times(loop.Kp, up(tube.tube.radii.position_m[i][axis] + position_error_m)) +
           up(times(loop.Kd, up(tube.tube.radii.velocity_m_s[i][axis] + velocity_error_m_s)) +
              times(loop.Ki, integral_m_s)));
    const double lag_N = lag_error_N(loop, acting, mass_kg);
    result.acceleration_m_s2[axis] =
        up(feedback + up(up(up(largest(acting.error_N) + lag_N) + excess_N) / mass_kg));
    integral_m_s = up(integral_m_s + sum_excess_m_s(loop, acting.met, result.acceleration_m_s2[axis]));
    const double fed_N = axis == 2 ? fed_forward_N(tube, scene.motion().stretch_of[i]) : 0;
    result.command_N[axis] = up(up(mass_kg * up(feedback + largest(acting.planned_m_s2))) + fed_N);
  }
  return result;
}

ForceErrorBounds bounds_of(const Scene& scene, const LocalTube& tube, const std::vector<Loads>& loads,
                           int vehicle, const std::vector<ForceConstants>& constants,
                           const ErrorHistory& lag) {
  ForceErrorBounds result;
  result.vehicle = vehicle;
  const Motion& motion = scene.motion();
  const auto i = static_cast<std::size_t>(vehicle);
  const Deviations deviations = all_within(tube.tube.radii);
  const double slice_s = up(motion.slice_s * (1 + 1e-12));
  double learned_rate = 0;
  double abrupt_N = 0;
  for (const int s : motion.stretch_of[i]) {
    const auto at = static_cast<std::size_t>(s);
    const Stretch& stretch = motion.stretches[at];
    const double size_N = tube.tube.force_N[at];
    result.amplitude_N = std::max(result.amplitude_N, size_N);
    result.impulse_N_s = up(result.impulse_N_s + up(size_N * slice_s));
    // The rate of the network follows from its constants, that of the truth from its gradient.
    const std::vector<Interval> states = scene.states(stretch, deviations);
    const ForceConstants none{kNotKnown, kNotKnown, kNotKnown, kNotKnown};
    const ForceConstants& c = constants.empty() ? none : constants[i];
    // The inputs of the network may jump by the estimation errors.
    double learned = scene.estimates().are_zero() ? 0 : kNotKnown;
    const double own_acceleration =
        up(length(loads[i].acceleration_m_s2) +
           length(stretch.acceleration_m_s2[0], stretch.acceleration_m_s2[1], stretch.acceleration_m_s2[2]));
    const TruthForce::Rest rest = scene.rest(stretch, deviations, own_acceleration);
    abrupt_N = std::max(abrupt_N, rest.abrupt_N[2]);
    double truth = rest.rate_N_s[2];
    for (int n = 0; n + 1 < scene.vehicles(); ++n) {
      const auto k = static_cast<std::size_t>(n * kPerNeighbour);
      const auto j = static_cast<std::size_t>(Scene::neighbour(vehicle, n));
      const double speed = length(states[k + 3], states[k + 4], states[k + 5]);
      const double* const a = loads[i].acceleration_m_s2;
      const double* const b = loads[j].acceleration_m_s2;
      const double acceleration = up(stretch.relative_acceleration_m_s2[static_cast<std::size_t>(n)] +
                                     length(up(a[0] + b[0]), up(a[1] + b[1]), up(a[2] + b[2])));
      learned = up(learned + slope_cost_N(c, speed, acceleration));
      truth = up(truth + times(tube.tube.truth[at].gradient_N_m[static_cast<std::size_t>(n)], speed));
    }
    if (c.own > 0) {
      const std::size_t own = states.size() - kOwnState;
      const double speed = states[own + 3].mag();
      learned = up(learned + times(c.own, length(speed, own_acceleration, 0)));
    }
    const double rate = up(learned + truth);
    learned_rate = std::max(learned_rate, learned);
    result.rate_N_s = std::max(result.rate_N_s, rate);
    result.variation_N = up(result.variation_N + up(rate * slice_s));
  }
  // The force error starts with a step, which is not part of the rate and the variation of the slices.
  const double start_N = tube.tube.force_N[static_cast<std::size_t>(motion.stretch_of[i].front())];
  result.variation_N = up(result.variation_N + start_N);
  const ErrorLoop& loop = scene.loops().axis[2];
  result.lag_m = lag.largest_position_m();
  const auto with_lag = [&](double bound) { return up(bound + result.lag_m); };
  // Discontinuous parts count as an amplitude: the difference of the staircase from its source, and abrupt effects.
  const double stair_m = times(loop.h1->total(), up(times(scene.network_age_s(), learned_rate) + abrupt_N));
  result.by_rate_m = result.by_edges_m = kNotKnown;
  if (loop.h) {
    result.by_rate_m =
        with_lag(up(up(times(loop.h->total(), result.rate_N_s) + up(loop.h->peak * start_N)) + stair_m));
    result.by_edges_m = with_lag(up(times(loop.h->peak, result.variation_N) + stair_m));
  }
  result.by_amplitude_m = with_lag(up(loop.h1->total() * result.amplitude_N));
  result.by_impulse_m = with_lag(up(loop.h1->peak * result.impulse_N_s));
  for (const Deviations& slice : tube.slices)
    result.by_slices_m = std::max(result.by_slices_m, slice[i].position_m[2].mag());
  return result;
}

Interval common(Interval a, Interval b) { return {std::max(a.lower, b.lower), std::min(a.upper, b.upper)}; }

/// Adds the errors of one vehicle per slice, as bounded by the sizes of all signals, within the bounds known already.
void add_slices(const std::array<ErrorHistory, 3>& history, std::size_t vehicle,
                std::vector<Deviations>& slices) {
  for (std::size_t n = 0; n < slices.size(); ++n) {
    Deviation& one = slices[n][vehicle];
    for (std::size_t k = 0; k < 3; ++k) {
      const double p = history[k].position_m[n];
      const double v = history[k].velocity_m_s[n];
      one.position_m[k] = common(one.position_m[k], {-p, p});
      one.velocity_m_s[k] = common(one.velocity_m_s[k], {-v, v});
    }
  }
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
          scene.states(motion.stretches[static_cast<std::size_t>(of_vehicle[n])], tube.slices[n]);
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

void check_tube(const Scene& scene, const std::vector<ForceConstants>& constants, LocalTube& tube) {
  std::vector<Loads> all;
  for (int i = 0; i < scene.vehicles(); ++i) {
    all.push_back(loads(scene, tube, i));
    check_integrators(scene, all.back(), tube);
  }
  const Deviations deviations = all_within(tube.tube.radii);
  tube.slices.assign(static_cast<std::size_t>(scene.motion().slices), deviations);
  if (tube.sliced.proved) tube.slices = tube.sliced.slices;
  for (int i = 0; i < scene.vehicles(); ++i) {
    std::array<ErrorHistory, 3> history = scene.other_errors(i, tube.tube.truth);
    const std::array<ErrorHistory, 3> hold =
        scene.hold_errors(i, tube.tube.radii, tube.tube.force_N, tube.tube.truth);
    for (std::size_t axis = 0; axis < 3; ++axis) history[axis].add(hold[axis]);
    const ErrorHistory lag = history[2];
    history[2] = scene.errors_z(i, tube.tube.force_N, lag);
    add_slices(history, static_cast<std::size_t>(i), tube.slices);
    tube.bounds.push_back(bounds_of(scene, tube, all, i, constants, lag));
  }
  count_residual_cells(scene, tube);
  add_assumptions(scene, thrust_use(scene.tracking().plant, all), neighbours_are_near(scene, deviations),
                  tube);
}

}  // namespace swarmcert::analysis
