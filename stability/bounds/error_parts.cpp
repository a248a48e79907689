#include "stability/bounds/error_parts.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "nn/base/doubles.h"
#include "stability/bounds/kernel_sum.h"
#include "stability/bounds/sampled_adjoint.h"

namespace swarmcert::stability {
namespace {

/// What is absent costs nothing, also where the gain is infinite.
template <class Gain>
double part(double size, const Gain& gain) {
  return size == 0 ? 0 : std::abs(size) * gain();
}

/// The largest response of `output`, a row over the state after control, to e = 1 or e' = 1 before the control at t = 0.
struct InitialResponse {
  double to_position = 0, to_velocity = 0;
};

InitialResponse initial_response(const SampledAdjoint& adjoint, const Eigen::RowVectorXd& output) {
  InitialResponse most;
  // The kernel of a force, start + slope u, is the response to a jump of the speed and to one of the position.
  const auto take = [&most](double start, double slope) {
    most.to_position = std::max(most.to_position, std::abs(slope));
    most.to_velocity = std::max(most.to_velocity, std::abs(start));
  };
  adjoint.force_kernel(
      output, [&](double start, double slope, double) { take(start, slope); },
      [&](double start, double slope, double, double) { take(start, slope); });
  return most;
}

}  // namespace

double OtherErrors::step_N() const { return std::max(std::abs(bias_N), start_N); }

ErrorParts error_parts(const AxisLoop& loop, double step_gain, const OtherErrors& errors) {
  ErrorParts parts;
  parts.bias_m = part(errors.step_N(), [&] { return step_gain; });
  // A jump of the speed is an impulse of force.
  parts.initial_m = part(errors.position_m, [&] { return initial_position_gain(loop); }) +
                    part(errors.velocity_m_s,
                         [&] { return loop.mass_kg * continuous_norms(loop, Channel::kForce).impulse; });
  parts.velocity_error_m =
      part(errors.velocity_error_m_s, [&] { return continuous_norms(loop, Estimate::kVelocity).amplitude; });
  parts.position_error_m =
      part(errors.position_error_m, [&] { return continuous_norms(loop, Estimate::kPosition).amplitude; });
  return parts;
}

ErrorParts error_parts(const SampledLoop& loop, double step_gain, const OtherErrors& errors) {
  ErrorParts parts;
  parts.bias_m = part(errors.step_N(), [&] { return step_gain; });
  parts.initial_m =
      part(errors.position_m, [&] { return initial_position_gain(loop); }) + part(errors.velocity_m_s, [&] {
        return loop.plant.mass_kg * sampled_norms(loop, Channel::kForce, Instants::kAll).impulse;
      });
  parts.velocity_error_m = part(errors.velocity_error_m_s, [&] {
    return sampled_norms(loop, Estimate::kVelocity, Instants::kAll).amplitude;
  });
  parts.position_error_m = part(errors.position_error_m, [&] {
    return sampled_norms(loop, Estimate::kPosition, Instants::kAll).amplitude;
  });
  return parts;
}

double initial_position_gain(const AxisLoop& loop) {
  // e = (s^2 L + s Kd exp(-Ts)) / D. With a delay the second term comes later by T, in which it moves by at most T times
  // its steepest slope.
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
  // Between two phases e leaves its chord by at most an eighth of the step's square times |e''|, and |e''| is at most
  // the largest command: the lags average it.
  const Eigen::Index command = adjoint.model().command_index();
  const Eigen::RowVectorXd commanded = Eigen::RowVectorXd::Unit(adjoint.model().size() + 1, command);
  return most + step_s * step_s / 8 * initial_response(adjoint, commanded).to_position;
}

double integral_demand_m_s(const AxisLoop& loop, Channel channel, const OtherErrors& errors) {
  const double step =
      part(errors.step_N(), [&] { return response_norms(step_transfer(loop, channel)).step_max_abs; });
  const double speed =
      part(errors.velocity_m_s, [&] { return loop.mass_kg * continuous_norms(loop, Channel::kForce).edge; });
  const double velocity_error =
      part(errors.velocity_error_m_s, [&] { return continuous_norms(loop, Estimate::kVelocity).rate; });
  // int e after e(0) = 1, and int (e + n) under |n| <= 1, are the integral and the absolute integral of one response:
  // (s^2 L + s Kd exp(-Ts)) / D, bounded with a delay as in initial_position_gain().
  const auto position = [&] {
    const GainNorms command = continuous_norms(loop, Channel::kCommand);
    return response_norms(initial_position_transfer(loop)).step_max_abs +
           loop.delay_s * loop.mass_kg * loop.Kd * command.impulse;
  };
  const auto position_error = [&] {
    const ResponseNorms command = response_norms(impulse_transfer(loop, Channel::kCommand));
    return response_norms(initial_position_transfer(loop)).integral_abs +
           (loop.delay_s == 0 ? 0 : loop.delay_s * loop.mass_kg * loop.Kd * command.variation);
  };
  return step + speed + velocity_error + part(errors.position_m, position) +
         part(errors.position_error_m, position_error);
}

double integral_demand_m_s(const SampledLoop& loop, Channel channel, const OtherErrors& errors) {
  const SampledAdjoint adjoint(loop, SampledAdjoint::Output::kIntegral);
  if (!adjoint.is_stable()) return kInfinity;
  const Eigen::RowVectorXd integral = adjoint.output_after_control(0);
  const auto step = [&] {
    double edge = 0;
    if (channel == Channel::kCommand) {
      edge = command_gains(adjoint, integral).edge;
    } else {
      KernelSum sum;
      add_force_kernel(adjoint, integral, sum);
      edge = sum.norms().edge;
    }
    return edge / loop.plant.mass_kg;
  };
  const auto speed = [&] { return initial_response(adjoint, integral).to_velocity; };
  const auto position = [&] { return initial_response(adjoint, integral).to_position; };
  const auto velocity_error = [&] {
    return input_gains(adjoint, integral, adjoint.model().measured_velocity()).amplitude;
  };
  const auto position_error = [&] {
    return input_gains(adjoint, integral, adjoint.model().measured_position()).amplitude;
  };
  return part(errors.step_N(), step) + part(errors.velocity_m_s, speed) + part(errors.position_m, position) +
         part(errors.velocity_error_m_s, velocity_error) + part(errors.position_error_m, position_error);
}

double effort_N(const AxisLoop& loop, const OtherErrors& errors) {
  const double effort = effort_gain(loop);
  // An error of an estimate is commanded at once, and the loop answers it as it answers a force.
  const auto velocity_error = [&] { return loop.Kd * (1 + effort); };
  const auto position_error = [&] {
    // Of the integral's share, -Ki s^2 L / D exp(-Ts): m h' of the force channel, differentiated.
    const ResponseNorms force = response_norms(impulse_transfer(loop, Channel::kForce));
    return loop.Kp * (1 + effort) + (loop.Ki > 0 ? loop.Ki * loop.mass_kg * force.variation : 0);
  };
  const auto speed = [&] { return loop.mass_kg * effort_impulse_gain(loop); };
  const auto position = [&] {
    // m (Kp e + Kd e' + Ki int e), each at its largest; e' is the response to an error of the estimated position.
    double most =
        loop.Kp * initial_position_gain(loop) + loop.Kd * continuous_norms(loop, Estimate::kPosition).impulse;
    if (loop.Ki > 0) {
      OtherErrors one;
      one.position_m = 1;
      most += loop.Ki * integral_demand_m_s(loop, Channel::kForce, one);
    }
    return most;
  };
  return part(errors.step_N(), [&] { return effort; }) +
         loop.mass_kg * (part(errors.velocity_error_m_s, velocity_error) +
                         part(errors.position_error_m, position_error) + part(errors.position_m, position)) +
         part(errors.velocity_m_s, speed);
}

}  // namespace swarmcert::stability
