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

/// Whether an axis has the same loop and force error as the previous one.
bool repeats(const FlownLoop& loop, const DisturbanceSource& source, int axis) {
  return axis > 0 && loop.continuous(axis) == loop.continuous(axis - 1) &&
         loop.integrator_limit_m_s(axis) == loop.integrator_limit_m_s(axis - 1) &&
         source.axis[axis] == source.axis[axis - 1] && source.bias_N[axis] == source.bias_N[axis - 1] &&
         source.velocity_error[axis] == source.velocity_error[axis - 1] &&
         source.position_error[axis] == source.position_error[axis - 1];
}

/// The loop at one point of the box; the law commands forces for the mass that it was told.
FlownLoop at_point(FlownLoop loop, const std::array<double, 4>& point) {
  loop.plant.told_mass_kg = loop.told_mass_kg();
  loop.plant.mass_kg = point[0];
  loop.plant.thrust_scale = point[1];
  loop.gains.motor_lag_s = point[2];
  loop.gains.delay_s = point[3];
  return loop;
}

void add_reached(const FlownLoop& setup, const UncertainPlant& box, const DisturbanceSource& source,
                 BoxBound& result) {
  const std::vector<std::array<double, 4>> points = points_of(box);
  for (const std::array<double, 4>& point : points) {
    const FlownLoop loop = at_point(setup, point);
    const Saturation found = saturation(loop, source, {});
    const bool is_worse = found.is_proved() == result.saturation.is_proved()
                              ? found.margin_N() < result.saturation.margin_N()
                              : !found.is_proved();
    if (&point == &points.front() || is_worse) result.saturation = found;
    for (int axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<std::size_t>(axis);
      if (repeats(setup, source, axis)) {
        result.reached_m[i] = result.reached_m[i - 1];
        result.where[i] = result.where[i - 1];
        continue;
      }
      for (const Channel channel : {Channel::kForce, Channel::kCommand}) {
        const double bound = axis_bounds(loop, flown_gains(loop, axis, channel), source, {}).least();
        if (bound <= result.reached_m[i]) continue;  // NaN is stored as well
        result.reached_m[i] = bound;
        result.where[i] = fmt::format(
            "{} channel, {} loop, mass {:.4g} kg, thrust scale {:.4g}, motor lag {:.4g} s, delay {:.4g} s",
            stability::name(channel), loop.is_sampled() ? "sampled" : "continuous", point[0], point[1],
            point[2], point[3]);
      }
    }
  }
}

double times(double gain, double size) { return size == 0 ? 0 : gain * size; }  // avoids infinity times zero

bool has_clamp(const FlownLoop& loop, int axis) {
  return loop.continuous(axis)->Ki > 0 && std::isfinite(loop.integrator_limit_m_s(axis));
}

/// @param axis of a sampled loop: with the Ki as written.
UncertainNorms norms_over(const FlownLoop& loop, const AxisLoop& axis, const UncertainPlant& box,
                          Channel channel) {
  if (!loop.is_sampled()) return uncertain_norms(axis, box, channel);
  return uncertain_norms(SampledLoop{axis, 1 / loop.gains.rate_hz, loop.gains.integrator_step_s}, box,
                         channel);
}

/// Bound of the estimation errors, treated as errors of the command: m Kd n for the velocity, m (Kp n + Ki int n) for
/// the position, where the integral term changes at a rate of at most m Ki |n|.
/// @param command gains from the command to the tracking error.
/// @param told gains and mass as used by the firmware.
double of_estimates(const FlownLoop& setup, const AxisLoop& told, const UncertainPlant& box,
                    const DisturbanceSource& source, int axis, const UncertainNorms& command) {
  const double force_N = box.thrust_scale.upper * told.mass_kg;
  const double velocity = source.velocity_error[axis].largest();
  const double position = source.position_error[axis].largest();
  return force_N * (times(command.amplitude.upper, told.Kd * velocity + told.Kp * position) +
                    times(command.rate.upper, told.Ki * setup.integral_share() * position));
}

/// Largest bound of one axis and channel over the box.
double enclosed(const FlownLoop& setup, const UncertainPlant& box, const DisturbanceSource& source, int axis,
                Channel channel) {
  FlownLoop told = setup;
  told.plant.thrust_scale = 1;
  told.gains.motor_lag_s = told.gains.delay_s = 0;
  const AxisLoop loop = told.is_sampled() ? told.sampled(axis)->plant : *told.continuous(axis);
  const Disturbance& d = source.axis[axis];
  const double bias = std::abs(source.bias_N[axis]);
  const UncertainNorms norms = norms_over(setup, loop, box, channel);
  const auto of_command = [&](const AxisLoop& of, const UncertainNorms& same) {
    return channel == Channel::kCommand ? same : norms_over(setup, of, box, Channel::kCommand);
  };
  const bool has_estimates = !source.velocity_error[axis].is_zero() || !source.position_error[axis].is_zero();
  const auto estimates_m = [&](const AxisLoop& of, const UncertainNorms& command) {
    return has_estimates ? of_estimates(setup, of, box, source, axis, command) : 0;
  };
  // The bias acts as a step; a measured amplitude or impulse contains it.
  const double step_m = times(norms.edge.upper, bias);
  double with_bias = times(norms.amplitude.upper, d.amplitude_N);
  if (d.passes == 1) with_bias = std::min(with_bias, times(norms.impulse.upper, d.impulse_N_s));
  if (!source.classes_contain_bias) with_bias += step_m;
  double least = std::min(with_bias, times(norms.rate.upper, d.rate_N_s) + step_m);
  if (d.passes == 1) least = std::min(least, times(norms.edge.upper, d.variation_N) + step_m);
  if (has_estimates) least += estimates_m(loop, of_command(loop, norms));
  if (!has_clamp(setup, axis)) return least;
  // int e responds to f as e responds to the integral of f: |int e| <= |h|_1 sup|f|, also for a bias. The
  // contribution of estimation errors to the integral is not enclosed.
  const double limit_m_s = setup.integrator_limit_m_s(axis);
  const double bias_beside = source.classes_contain_bias ? 0 : bias;
  if (!has_estimates && times(norms.rate.upper, d.amplitude_N + bias_beside) <= limit_m_s) return least;
  AxisLoop no_integral = loop;
  no_integral.Ki = 0;
  const UncertainNorms without = norms_over(setup, no_integral, box, channel);
  const UncertainNorms command = of_command(no_integral, without);
  return times(without.amplitude.upper, d.amplitude_N) + times(without.edge.upper, bias_beside) +
         times(command.amplitude.upper, box.thrust_scale.upper * loop.mass_kg * loop.Ki * limit_m_s) +
         estimates_m(no_integral, command);
}

}  // namespace

BoxBound bound_over(const FlownLoop& setup, const UncertainPlant& box, const DisturbanceSource& source) {
  BoxBound result;
  for (int axis = 0; axis < 3; ++axis) {
    if (setup.continuous(axis)) continue;
    std::fill(std::begin(result.reached_m), std::end(result.reached_m),
              std::numeric_limits<double>::quiet_NaN());
    return result;
  }
  add_reached(setup, box, source, result);
  result.is_enclosed =
      !setup.is_sampled() || !(has_clamp(setup, 0) || has_clamp(setup, 1) || has_clamp(setup, 2));
  const FloatErrors float32 = float_errors(setup, tracking_bounds(setup, {}, {}));
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    if (result.is_enclosed && repeats(setup, source, axis)) {
      result.enclosed_m[i] = result.enclosed_m[i - 1];
    } else if (result.is_enclosed) {
      result.enclosed_m[i] = std::max(enclosed(setup, box, source, axis, Channel::kForce),
                                      enclosed(setup, box, source, axis, Channel::kCommand));
    }
  }
  for (std::size_t i = 0; i < 3; ++i) {
    result.reached_m[i] += float32.tracking_error_m[i];
    result.enclosed_m[i] += float32.tracking_error_m[i];
  }
  return result;
}

}  // namespace swarmcert::gate
