#include "stability/bounds/error_parts.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "nn/base/doubles.h"
#include "stability/bounds/disturbance_bounds.h"
#include "stability/bounds/loops/kernel_sum.h"
#include "stability/bounds/loops/reference_jerk.h"
#include "stability/bounds/loops/sampled_adjoint.h"
#include "stability/bounds/sampled_bounds.h"

namespace swarmcert::stability {
namespace {

/// Returns |size| gain(); 0 if size is 0, even if the gain is infinite.
template <class Gain>
double part(double size, const Gain& gain) {
  return size == 0 ? 0 : std::abs(size) * gain();
}

/// The largest response of `output`, a row over the state after the control, to e = 1 or e' = 1 before the control at
/// t = 0.
struct InitialResponse {
  double to_position = 0, to_velocity = 0;
};

InitialResponse initial_response(const SampledAdjoint& adjoint, const Eigen::RowVectorXd& output) {
  InitialResponse most;
  // The kernel of a force, start + slope u, gives the responses to a jump of the velocity (start) and of the position
  // (slope).
  const auto take = [&most](double start, double slope) {
    most.to_position = std::max(most.to_position, std::abs(slope));
    most.to_velocity = std::max(most.to_velocity, std::abs(start));
  };
  adjoint.force_kernel(
      output, [&](double start, double slope, double) { take(start, slope); },
      [&](double start, double slope, double, double) { take(start, slope); });
  return most;
}

/// Converts an error n of the velocity to an error of the command, -m Kd n.
Disturbance as_command(const EstimateError& n, double scale_N) {
  Disturbance error;
  error.rate_N_s = scale_N * n.rate;
  error.amplitude_N = scale_N * n.amplitude;
  error.variation_N = scale_N * n.variation;
  error.impulse_N_s = scale_N * n.impulse;
  if (n.window_s > 0) {
    error.passes = Disturbance::kManyPasses;
    error.pass_period_s = error.pass_length_s = n.window_s;
    error.variation_per_pass = true;
  }
  return error;
}

DisturbanceBounds by_command(const AxisLoop& loop, const Disturbance& error) {
  return disturbance_bounds(loop, Channel::kCommand, error);
}
DisturbanceBounds by_command(const SampledLoop& loop, const Disturbance& error) {
  return disturbance_bounds(loop, Channel::kCommand, norms_of(loop, Channel::kCommand), error);
}

template <class AnyLoop>
double velocity_part(const AnyLoop& loop, const EstimateError& n) {
  if (n.is_zero()) return 0;
  const AxisLoop& plant = plant_of(loop);
  const GainNorms gains = norms_of(loop, Estimate::kVelocity);
  const double by_amplitude = times_known(gains.amplitude, n.amplitude);
  const bool has_more = std::isfinite(std::min({n.rate, n.variation, n.impulse}));
  if (!has_more || plant.Kd == 0) return by_amplitude;
  const DisturbanceBounds bounds = by_command(loop, as_command(n, plant.mass_kg * plant.Kd));
  const double constant_m = part(n.constant, [&] { return gains.edge; });
  // The edge bound for windows includes the first rise by the amplitude, which contains the constant part.
  const double at_first_m = n.window_s > 0 ? 0 : constant_m;
  return std::min({by_amplitude, bounds.by_impulse, bounds.by_edges + at_first_m,
                   std::min(bounds.by_rate, bounds.by_both) + constant_m});
}

template <class AnyLoop>
double position_part(const AnyLoop& loop, const EstimateError& n) {
  if (n.is_zero()) return 0;
  const GainNorms gains = norms_of(loop, Estimate::kPosition);
  double least = times_known(gains.amplitude, n.largest());
  if (n.window_s == 0) {
    least =
        std::min(least, times_known(gains.edge, n.variation) + part(n.constant, [&] { return gains.edge; }));
    least = std::min(least, times_known(gains.impulse, n.impulse));
  }
  if (std::isfinite(n.rate) && std::isfinite(n.largest())) {
    // A constant error of the estimate acts like an initial position error of the same size.
    least = std::min(least, n.largest() + part(n.rate, [&] { return drift_gain(loop); }) +
                                part(n.constant, [&] { return initial_position_gain(loop); }));
  }
  return least;
}

template <class AnyLoop>
ErrorParts parts_of(const AnyLoop& loop, double step_gain, const OtherErrors& errors) {
  const auto by_position = [&] { return initial_position_gain(loop); };
  // A jump of the velocity is an impulse of force.
  const auto by_velocity = [&] { return plant_of(loop).mass_kg * norms_of(loop, Channel::kForce).impulse; };
  const ReferenceMotion& reference = errors.reference;
  ErrorParts parts;
  parts.bias_m = part(errors.step_N(), [&] { return step_gain; });
  parts.initial_m = part(errors.position_m, by_position) + part(errors.velocity_m_s, by_velocity);
  parts.velocity_error_m = velocity_part(loop, errors.velocity_error);
  parts.position_error_m = position_part(loop, errors.position_error);
  parts.reference_m = part(reference.steps_m, by_position) + part(reference.speed_steps_m_s, by_velocity) +
                      part(reference.jerk_m_s3, [&] { return jerk_gain(loop); });
  return parts;
}

/// Returns the smallest demand that the classes of an estimate's error give; for windows only the amplitude counts.
/// @param amplitude, edge, impulse gains, evaluated on demand.
template <class Amplitude, class Edge, class Impulse>
double least_demand(const EstimateError& n, const Amplitude& amplitude, const Edge& edge,
                    const Impulse& impulse) {
  if (n.is_zero()) return 0;
  double least = std::isfinite(n.largest()) ? n.largest() * amplitude() : kInfinity;
  if (n.window_s > 0) return least;
  if (std::isfinite(n.variation)) least = std::min(least, (n.variation + std::abs(n.constant)) * edge());
  if (std::isfinite(n.impulse)) least = std::min(least, n.impulse * impulse());
  return least;
}

/// Returns the demand of the reference on the integrator: its jumps act like initial errors, its jerk like a force of
/// age times jerk.
/// @param position, speed, force demands per m, per m/s and per m/s^2.
template <class AnyLoop, class Position, class Speed, class Force>
double reference_demand(const AnyLoop& loop, const ReferenceMotion& reference, const Position& position,
                        const Speed& speed, const Force& force) {
  return part(reference.steps_m, position) + part(reference.speed_steps_m_s, speed) +
         part(reference.jerk_m_s3 * acceleration_age_s(loop), force);
}

}  // namespace

bool EstimateError::is_zero() const { return impulse == 0 || largest() == 0 || (rate == 0 && constant == 0); }

double EstimateError::largest() const {
  return window_s > 0 ? amplitude : std::min(amplitude, variation + std::abs(constant));
}

double OtherErrors::step_N() const { return std::max(std::abs(bias_N), start_N); }

ErrorParts error_parts(const AxisLoop& loop, double step_gain, const OtherErrors& errors) {
  return parts_of(loop, step_gain, errors);
}

ErrorParts error_parts(const SampledLoop& loop, double step_gain, const OtherErrors& errors) {
  return parts_of(loop, step_gain, errors);
}

double drift_gain(const AxisLoop& loop) {
  // (s^2 L + s Kd exp(-Ts)) / D acting on n'; with a delay as in initial_position_gain().
  const double together = response_norms(initial_position_transfer(loop)).integral_abs;
  if (loop.delay_s == 0 || !std::isfinite(together)) return together;
  const ResponseNorms command = response_norms(impulse_transfer(loop, Channel::kCommand));
  return together + loop.delay_s * loop.mass_kg * loop.Kd * command.variation;
}

double drift_gain(const SampledLoop& loop) {
  const SampledAdjoint adjoint(loop);
  if (!adjoint.is_stable()) return kInfinity;
  const Eigen::VectorXd input = adjoint.model().measured_position();
  const auto rate_at = [&](double phase_s) {
    return input_gains(adjoint, adjoint.output_after_control(phase_s), input, true, 1).rate;
  };
  constexpr int kPhases = 8;
  const double step_s = loop.period_s / kPhases;
  double most = 0;
  for (int i = 0; i <= kPhases; ++i) most = std::max(most, rate_at(i * step_s));
  // Between two phases e deviates from its chord as in initial_position_gain(); n stays that of the last sample.
  return most + step_s * step_s / 8 * input_gains(adjoint, adjoint.model().commanded(), input).rate;
}

double initial_position_gain(const AxisLoop& loop) {
  // e = (s^2 L + s Kd exp(-Ts)) / D. With a delay the second term comes later by T, during which it changes by at most
  // T times its steepest slope.
  const double together = response_norms(initial_position_transfer(loop)).max_abs();
  if (loop.delay_s == 0 || !std::isfinite(together)) return std::max(1.0, together);
  const ResponseNorms command = response_norms(impulse_transfer(loop, Channel::kCommand));
  return std::max(1.0, together + loop.delay_s * loop.mass_kg * loop.Kd * command.slope_max_abs);
}

double initial_position_gain(const SampledLoop& loop) {
  const SampledAdjoint adjoint(loop);
  if (!adjoint.is_stable()) return kInfinity;
  constexpr int kPhases = 8;
  const double step_s = loop.period_s / kPhases;
  double most = 1;
  for (int i = 0; i < kPhases; ++i) {
    most = std::max(most, initial_response(adjoint, adjoint.output_after_control(i * step_s)).to_position);
  }
  // Between two phases e deviates from its chord by at most an eighth of the squared step times |e''|, and |e''| is at
  // most the largest command, since the lags average the commands.
  return most + step_s * step_s / 8 * initial_response(adjoint, adjoint.model().commanded()).to_position;
}

double integral_demand_m_s(const AxisLoop& loop, Channel channel, const OtherErrors& errors) {
  const double step =
      part(errors.step_N(), [&] { return response_norms(step_transfer(loop, channel)).step_max_abs; });
  const auto by_speed = [&] { return loop.mass_kg * continuous_norms(loop, Channel::kForce).edge; };
  const auto by_force = [&] { return loop.mass_kg * continuous_norms(loop, Channel::kForce).rate; };
  const double speed = part(errors.velocity_m_s, by_speed);
  const double velocity_error = least_demand(
      errors.velocity_error, [&] { return continuous_norms(loop, Estimate::kVelocity).rate; },
      [&] {
        const ResponseNorms h = response_norms(step_transfer(loop, Channel::kCommand));
        return loop.mass_kg * loop.Kd * h.step_max_abs;
      },
      [&] { return continuous_norms(loop, Estimate::kVelocity).edge; });
  // int e after e(0) = 1, and int (e + n) under |n| <= 1, are the integral and the absolute integral of one response:
  // (s^2 L + s Kd exp(-Ts)) / D, bounded with a delay as in initial_position_gain().
  const auto position = [&] {
    const GainNorms command = continuous_norms(loop, Channel::kCommand);
    return response_norms(initial_position_transfer(loop)).step_max_abs +
           loop.delay_s * loop.mass_kg * loop.Kd * command.impulse;
  };
  const double position_error = least_demand(
      errors.position_error, [&] { return drift_gain(loop); }, position,
      [&] { return initial_position_gain(loop); });
  return step + speed + velocity_error + part(errors.position_m, position) + position_error +
         reference_demand(loop, errors.reference, position, by_speed, by_force);
}

namespace {

/// Returns the largest value of an output, a row over the state after the control, due to all errors together.
double largest_output(const SampledLoop& loop, const SampledAdjoint& adjoint,
                      const Eigen::RowVectorXd& output, Channel channel, const OtherErrors& errors) {
  const auto step = [&] {
    double edge = 0;
    if (channel == Channel::kCommand) {
      edge = command_gains(adjoint, output).edge;
    } else {
      edge = force_gains(adjoint, output).edge;
    }
    return edge / loop.plant.mass_kg;
  };
  const auto speed = [&] { return initial_response(adjoint, output).to_velocity; };
  const auto position = [&] { return initial_response(adjoint, output).to_position; };
  // A jump of the velocity between two samples has moved the setpoint by at most a period of it when the law sees it.
  const auto speed_step = [&] { return speed() + loop.period_s * position(); };
  const auto force = [&] { return force_gains(adjoint, output).amplitude; };
  const auto demand = [&](const EstimateError& n, const Eigen::VectorXd& input) {
    if (n.is_zero()) return 0.0;
    const GainNorms gains = input_gains(adjoint, output, input);
    return least_demand(
        n, [&] { return gains.amplitude; }, [&] { return gains.edge; }, [&] { return gains.impulse; });
  };
  return part(errors.step_N(), step) + part(errors.velocity_m_s, speed) + part(errors.position_m, position) +
         demand(errors.velocity_error, adjoint.model().measured_velocity()) +
         demand(errors.position_error, adjoint.model().measured_position()) +
         reference_demand(loop, errors.reference, position, speed_step, force);
}

}  // namespace

double integral_demand_m_s(const SampledLoop& loop, Channel channel, const OtherErrors& errors) {
  const SampledAdjoint adjoint(loop, SampledAdjoint::Output::kIntegral);
  if (!adjoint.is_stable()) return kInfinity;
  return largest_output(loop, adjoint, adjoint.output_after_control(0), channel, errors);
}

double effort_gain(const SampledLoop& loop) {
  const SampledAdjoint adjoint(loop);
  if (!adjoint.is_stable()) return kInfinity;
  return force_gains(adjoint, adjoint.model().commanded()).amplitude;
}

double effort_N(const SampledLoop& loop, const OtherErrors& errors, Channel channel) {
  const SampledAdjoint adjoint(loop);
  if (!adjoint.is_stable()) return kInfinity;
  return loop.plant.mass_kg * largest_output(loop, adjoint, adjoint.model().commanded(), channel, errors);
}

double effort_N(const AxisLoop& loop, const OtherErrors& errors, Channel channel) {
  const double effort = effort_gain(loop);
  // An error of an estimate enters the command immediately, and the loop responds to it as to a force.
  const auto velocity_error = [&] { return loop.Kd * (1 + effort); };
  const auto position_error = [&] {
    // For the integral's share, -Ki s^2 L / D exp(-Ts): m h' of the force channel, differentiated.
    const ResponseNorms force = response_norms(impulse_transfer(loop, Channel::kForce));
    return loop.Kp * (1 + effort) + (loop.Ki > 0 ? loop.Ki * loop.mass_kg * force.variation : 0);
  };
  const auto speed = [&] { return loop.mass_kg * effort_impulse_gain(loop); };
  const auto position = [&] {
    // m (Kp e + Kd e' + Ki int e), with each term at its maximum; e' is the response to an error of the estimated
    // position.
    double most =
        loop.Kp * initial_position_gain(loop) + loop.Kd * continuous_norms(loop, Estimate::kPosition).impulse;
    if (loop.Ki > 0) {
      OtherErrors one;
      one.position_m = 1;
      most += loop.Ki * integral_demand_m_s(loop, Channel::kForce, one);
    }
    return most;
  };
  return part(errors.step_N(), [&] { return effort_gain(loop, channel); }) +
         loop.mass_kg *
             (part(errors.velocity_error.largest(), velocity_error) +
              part(errors.position_error.largest(), position_error) + part(errors.position_m, position)) +
         part(errors.velocity_m_s, speed) + loop.mass_kg * part(errors.reference.steps_m, position) +
         part(errors.reference.speed_steps_m_s, speed) +
         loop.mass_kg * part(errors.reference.jerk_m_s3 * acceleration_age_s(loop), [&] { return effort; });
}

}  // namespace swarmcert::stability
