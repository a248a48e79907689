#include "stability/bounds/swarms/estimate_motion.h"

#include <algorithm>
#include <cmath>

#include "nn/base/doubles.h"

namespace swarmcert::stability {
namespace {

/// Returns size times gain; 0 if the size is 0, even if the gain is infinite, and infinite if the size is unknown.
double known_times(double size, double gain) {
  return size == 0 ? 0 : std::isinf(size) ? kInfinity : size * gain;
}

/// Gains from an error of an estimate to e' and e'', for its amplitude and for its rate.
struct MotionGains {
  double speed_by_amplitude = 0, speed_by_rate = 0;
  double acceleration_by_amplitude = 0, acceleration_by_rate = 0;
};

/// @param slope_at_once value of the kernel's slope at t = 0, if the law acts without a lag.
MotionGains motion_gains(const ResponseNorms& kernel, double slope_at_once) {
  MotionGains gains;
  gains.speed_by_amplitude = kernel.variation;
  gains.speed_by_rate = kernel.integral_abs;
  gains.acceleration_by_amplitude = kernel.curvature_integral + slope_at_once;
  gains.acceleration_by_rate = kernel.variation;
  return gains;
}

void add_motion(const EstimateError& n, const MotionGains& gains, OwnMotion& motion) {
  if (n.is_zero()) return;
  motion.speed_m_s +=
      std::min(known_times(n.largest(), gains.speed_by_amplitude), known_times(n.rate, gains.speed_by_rate));
  motion.acceleration_m_s2 += std::min(known_times(n.largest(), gains.acceleration_by_amplitude),
                                       known_times(n.rate, gains.acceleration_by_rate));
}

}  // namespace

OwnMotion estimate_motion(const AxisLoop& loop, const OtherErrors& errors) {
  OtherErrors of_estimates;
  of_estimates.velocity_error = errors.velocity_error;
  of_estimates.position_error = errors.position_error;
  OwnMotion motion;
  motion.error_m = error_parts(loop, 0, of_estimates).total_m();
  const bool acts_at_once =
      std::all_of(loop.lags_s.begin(), loop.lags_s.end(), [](double lag_s) { return !(lag_s > 0); });
  if (!errors.velocity_error.is_zero() && loop.Kd > 0) {
    ResponseNorms kernel = response_norms(impulse_transfer(loop, Channel::kCommand));
    const double scale = loop.mass_kg * loop.Kd;
    kernel.integral_abs *= scale;
    kernel.variation *= scale;
    kernel.curvature_integral *= scale;
    add_motion(errors.velocity_error, motion_gains(kernel, acts_at_once ? loop.Kd : 0), motion);
  }
  if (!errors.position_error.is_zero()) {
    const ResponseNorms kernel = response_norms(position_error_transfer(loop));
    add_motion(errors.position_error, motion_gains(kernel, acts_at_once ? loop.Kp : 0), motion);
  }
  return motion;
}

OwnMotion force_motion(const AxisLoop& loop, const Disturbance& force, double bias_N) {
  OwnMotion motion;
  EstimateError class_of;  // of a signal, in any unit
  class_of.amplitude = std::min(force.amplitude_N, force.variation_per_pass ? kInfinity : force.variation_N);
  class_of.rate = force.rate_N_s;
  if (!class_of.is_zero()) {
    const ResponseNorms kernel = response_norms(impulse_transfer(loop, Channel::kCommand));
    const bool acts_at_once =
        std::all_of(loop.lags_s.begin(), loop.lags_s.end(), [](double lag_s) { return !(lag_s > 0); });
    add_motion(class_of, motion_gains(kernel, acts_at_once ? 1 / loop.mass_kg : 0), motion);
    motion.error_m = std::min(known_times(class_of.largest(), kernel.integral_abs),
                              known_times(class_of.rate, rate_gains(loop).position));
  }
  if (bias_N != 0 && !(loop.Ki > 0)) motion.error_m += std::abs(bias_N) / (loop.mass_kg * loop.Kp);
  return motion;
}

}  // namespace swarmcert::stability
