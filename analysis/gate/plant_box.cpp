#include "analysis/gate/plant_box.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "stability/bounds/sampled_bounds.h"
#include "stability/bounds/theorem.h"
#include "stability/simulation/float_errors.h"

namespace swarmcert::gate {
namespace {

using namespace stability;  // NOLINT: every name below is of that library

/// Converts the firmware's control law to PID gains, so that the true mass may differ from the nominal one.
bool as_pid(const TrackingSetup& setup, Gains& gains) {
  PidGains pid{};
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    const std::optional<controller::AxisPid<double>> one = axis_gains(setup.gains, setup.plant.mass_kg, axis);
    if (!one) return false;
    pid.Kp_1_s2[i] = one->Kp_1_s2;
    pid.Kd_1_s[i] = one->Kd_1_s;
    pid.Ki_1_s3[i] = one->Ki_1_s3;
  }
  gains = setup.gains;
  gains.composite.reset();
  gains.pid = pid;
  return true;
}

/// The points of the box at which bounds are evaluated: its centre, then its corners, without duplicates.
std::vector<std::array<double, 4>> points_of(const UncertainPlant& box) {
  const Interval ranges[] = {box.mass_kg, box.thrust_scale, box.lag_s, box.delay_s};
  std::vector<std::array<double, 4>> points(1);
  for (std::size_t k = 0; k < 4; ++k) points[0][k] = (ranges[k].lower + ranges[k].upper) / 2;
  for (unsigned corner = 0; corner < 16; ++corner) {
    std::array<double, 4> point{};
    for (std::size_t k = 0; k < 4; ++k) point[k] = (corner >> k) % 2 == 0 ? ranges[k].lower : ranges[k].upper;
    if (std::find(points.begin(), points.end(), point) == points.end()) points.push_back(point);
  }
  return points;
}

/// AxisBounds::least() for one plant: the loop used in flight, at all times.
double nominal_bound(const Gains& gains, const Plant& plant, const DisturbanceSource& source, int axis,
                     Channel channel) {
  const Disturbance& d = source.axis[axis];
  const OtherErrors other = source.other(axis, {}, plant);
  const double limit_m_s = gains.integrator_limit_m_s[static_cast<std::size_t>(axis)];
  if (const std::optional<SampledLoop> sampled = sampled_axis_loop(gains, plant, axis)) {
    return axis_bounds(*sampled, channel, sampled_norms(*sampled, channel, Instants::kAll), d, other,
                       source.classes_contain_bias, limit_m_s)
        .least();
  }
  const AxisLoop loop = *axis_loop(gains, plant, axis);
  return axis_bounds(loop, channel, continuous_norms(loop, channel), d, other, source.classes_contain_bias,
                     limit_m_s)
      .least();
}

/// Whether an axis has the same loop and force error as the previous one.
bool repeats(const Gains& pid, const DisturbanceSource& source, int axis) {
  if (axis == 0) return false;
  const auto i = static_cast<std::size_t>(axis);
  return pid.pid->Kp_1_s2[i] == pid.pid->Kp_1_s2[i - 1] && pid.pid->Kd_1_s[i] == pid.pid->Kd_1_s[i - 1] &&
         pid.pid->Ki_1_s3[i] == pid.pid->Ki_1_s3[i - 1] &&
         pid.integrator_limit_m_s[i] == pid.integrator_limit_m_s[i - 1] &&
         (axis < 2 || pid.attitude_lag_s == 0) && source.axis[axis] == source.axis[axis - 1] &&
         source.bias_N[axis] == source.bias_N[axis - 1] &&
         source.velocity_error[axis] == source.velocity_error[axis - 1] &&
         source.position_error[axis] == source.position_error[axis - 1];
}

std::pair<Gains, Plant> at_point(const TrackingSetup& setup, const Gains& pid,
                                 const std::array<double, 4>& point) {
  Gains gains = pid;
  gains.motor_lag_s = point[2];
  gains.delay_s = point[3];
  Plant plant = setup.plant;
  plant.mass_kg = point[0];
  plant.thrust_scale = point[1] * setup.plant.mass_kg / point[0];
  return {gains, plant};
}

void add_reached(const TrackingSetup& setup, const Gains& pid, const UncertainPlant& box,
                 const DisturbanceSource& source, BoxBound& result) {
  for (const std::array<double, 4>& point : points_of(box)) {
    const auto [gains, plant] = at_point(setup, pid, point);
    for (int axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<std::size_t>(axis);
      if (repeats(pid, source, axis)) {
        result.reached_m[i] = result.reached_m[i - 1];
        result.where[i] = result.where[i - 1];
        continue;
      }
      for (const Channel channel : {Channel::kForce, Channel::kCommand}) {
        const double bound = nominal_bound(gains, plant, source, axis, channel);
        if (bound <= result.reached_m[i]) continue;  // NaN is stored as well
        result.reached_m[i] = bound;
        result.where[i] = fmt::format(
            "{} channel, {} loop, mass {:.4g} kg, thrust scale {:.4g}, motor lag {:.4g} s, delay {:.4g} s",
            stability::name(channel), pid.rate_hz > 0 ? "sampled" : "continuous", point[0], point[1],
            point[2], point[3]);
      }
    }
  }
}

/// Least margin to saturation at the corners and the centre of the box; infinite if it is unknown.
double least_thrust_margin_N(const TrackingSetup& setup, const Gains& pid, const UncertainPlant& box,
                             const DisturbanceSource& source) {
  double least_N = std::numeric_limits<double>::infinity();
  for (const std::array<double, 4>& point : points_of(box)) {
    const auto [gains, plant] = at_point(setup, pid, point);
    Plant rotors = plant;
    rotors.thrust_scale = point[1];  // of the maximum thrust, whatever mass the law is told
    const std::optional<double> margin_N = thrust_margin_N(rotors, *axis_loop(gains, plant, 2), source, {});
    least_N = std::min(least_N, margin_N.value_or(least_N));
  }
  return least_N;
}

double times(double gain, double size) { return size == 0 ? 0 : gain * size; }  // avoids infinity times zero

bool has_clamp(const Gains& pid, int axis) {
  const auto i = static_cast<std::size_t>(axis);
  return pid.pid->Ki_1_s3[i] > 0 && std::isfinite(pid.integrator_limit_m_s[i]);
}

UncertainNorms norms_over(const Gains& pid, const AxisLoop& loop, const UncertainPlant& box,
                          Channel channel) {
  if (pid.rate_hz == 0) return uncertain_norms(loop, box, channel);
  return uncertain_norms(SampledLoop{loop, 1 / pid.rate_hz, pid.integrator_step_s}, box, channel);
}

/// Bound of the estimation errors, treated as errors of the command: m Kd n for the velocity, m (Kp n + Ki int n) for
/// the position, where the integral term changes at a rate of at most m Ki |n|.
/// @param command gains from the command to the tracking error.
/// @param told gains and mass as used by the firmware.
double of_estimates(const Gains& pid, const AxisLoop& told, const UncertainPlant& box,
                    const DisturbanceSource& source, int axis, const UncertainNorms& command) {
  const double period_share = pid.rate_hz > 0 ? pid.integrator_step_s * pid.rate_hz : 1;
  const double force_N = box.thrust_scale.upper * told.mass_kg;
  const double velocity = source.velocity_error[axis].largest();
  const double position = source.position_error[axis].largest();
  return force_N * (times(command.amplitude.upper, told.Kd * velocity + told.Kp * position) +
                    times(command.rate.upper, told.Ki * period_share * position));
}

/// Largest bound of one axis and channel over the box.
double enclosed(const TrackingSetup& setup, const Gains& pid, const UncertainPlant& box,
                const DisturbanceSource& source, int axis, Channel channel) {
  Plant told = setup.plant;
  told.thrust_scale = 1;
  AxisLoop loop = *axis_loop(pid, told, axis);
  loop.lags_s.clear();
  if (axis < 2 && pid.attitude_lag_s > 0) loop.lags_s.push_back(pid.attitude_lag_s);
  loop.delay_s = 0;
  const Disturbance& d = source.axis[axis];
  const double bias = std::abs(source.bias_N[axis]);
  const UncertainNorms norms = norms_over(pid, loop, box, channel);
  const auto of_command = [&](const AxisLoop& of, const UncertainNorms& same) {
    return channel == Channel::kCommand ? same : norms_over(pid, of, box, Channel::kCommand);
  };
  const bool has_estimates = !source.velocity_error[axis].is_zero() || !source.position_error[axis].is_zero();
  const auto estimates_m = [&](const AxisLoop& of, const UncertainNorms& command) {
    return has_estimates ? of_estimates(pid, of, box, source, axis, command) : 0;
  };
  // The bias acts as a step; a measured amplitude or impulse contains it.
  const double step_m = times(norms.edge.upper, bias);
  double with_bias = times(norms.amplitude.upper, d.amplitude_N);
  if (d.passes == 1) with_bias = std::min(with_bias, times(norms.impulse.upper, d.impulse_N_s));
  if (!source.classes_contain_bias) with_bias += step_m;
  double least = std::min(with_bias, times(norms.rate.upper, d.rate_N_s) + step_m);
  if (d.passes == 1) least = std::min(least, times(norms.edge.upper, d.variation_N) + step_m);
  if (has_estimates) least += estimates_m(loop, of_command(loop, norms));
  if (!has_clamp(pid, axis)) return least;
  // int e responds to f as e responds to the integral of f: |int e| <= |h|_1 sup|f|, also for a bias. The
  // contribution of estimation errors to the integral is not enclosed.
  const double limit_m_s = pid.integrator_limit_m_s[static_cast<std::size_t>(axis)];
  const double bias_beside = source.classes_contain_bias ? 0 : bias;
  if (!has_estimates && times(norms.rate.upper, d.amplitude_N + bias_beside) <= limit_m_s) return least;
  AxisLoop no_integral = loop;
  no_integral.Ki = 0;
  const UncertainNorms without = norms_over(pid, no_integral, box, channel);
  const UncertainNorms command = of_command(no_integral, without);
  return times(without.amplitude.upper, d.amplitude_N) + times(without.edge.upper, bias_beside) +
         times(command.amplitude.upper, box.thrust_scale.upper * told.mass_kg * loop.Ki * limit_m_s) +
         estimates_m(no_integral, command);
}

}  // namespace

BoxBound bound_over(const TrackingSetup& setup, const UncertainPlant& box, const DisturbanceSource& source) {
  BoxBound result;
  Gains pid;
  if (!as_pid(setup, pid)) {
    std::fill(std::begin(result.reached_m), std::end(result.reached_m),
              std::numeric_limits<double>::quiet_NaN());
    return result;
  }
  add_reached(setup, pid, box, source, result);
  result.thrust_margin_N = least_thrust_margin_N(setup, pid, box, source);
  result.is_enclosed = pid.rate_hz == 0 || !(has_clamp(pid, 0) || has_clamp(pid, 1) || has_clamp(pid, 2));
  const FloatErrors float32 = float_errors(setup, tracking_bounds(setup.gains, setup.plant, {}, {}));
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    if (result.is_enclosed && repeats(pid, source, axis)) {
      result.enclosed_m[i] = result.enclosed_m[i - 1];
    } else if (result.is_enclosed) {
      result.enclosed_m[i] = std::max(enclosed(setup, pid, box, source, axis, Channel::kForce),
                                      enclosed(setup, pid, box, source, axis, Channel::kCommand));
    }
  }
  for (std::size_t i = 0; i < 3; ++i) {
    result.reached_m[i] += float32.tracking_error_m[i];
    result.enclosed_m[i] += float32.tracking_error_m[i];
  }
  return result;
}

}  // namespace swarmcert::gate
