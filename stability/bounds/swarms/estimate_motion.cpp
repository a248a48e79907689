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

/// Adds e' and e'' due to a signal times `scale`, by its amplitude and by its rate.
/// @param kernel the response of e to an impulse of the signal.
/// @param slope_at_once value of the kernel's slope at t = 0, if the law acts without a lag.
void add_motion(const AxisLoop& loop, const EstimateError& n, double scale, const ResponseNorms& kernel,
                double slope_at_once, OwnMotion& motion) {
  const bool has_lag =
      std::any_of(loop.lags_s.begin(), loop.lags_s.end(), [](double lag_s) { return lag_s > 0; });
  const double most = n.largest() * scale, rate = n.rate * scale;
  motion.speed_m_s += std::min(known_times(most, kernel.variation), known_times(rate, kernel.integral_abs));
  motion.acceleration_m_s2 +=
      std::min(known_times(most, kernel.curvature_integral + (has_lag ? 0 : slope_at_once)),
               known_times(rate, kernel.variation));
}

}  // namespace

OwnMotion estimate_motion(const AxisLoop& loop, const OtherErrors& errors) {
  OtherErrors of_estimates;
  of_estimates.velocity_error = errors.velocity_error;
  of_estimates.position_error = errors.position_error;
  OwnMotion motion;
  motion.error_m = error_parts(loop, 0, of_estimates).total_m();
  if (!errors.velocity_error.is_zero() && loop.Kd > 0)
    add_motion(loop, errors.velocity_error, loop.mass_kg * loop.Kd,
               response_norms(impulse_transfer(loop, Channel::kCommand)), 1 / loop.mass_kg, motion);
  if (!errors.position_error.is_zero())
    add_motion(loop, errors.position_error, 1, response_norms(position_error_transfer(loop)), loop.Kp,
               motion);
  return motion;
}

OwnMotion force_motion(const AxisLoop& loop, const Disturbance& force, double bias_N) {
  OwnMotion motion;
  EstimateError class_of;  // of a signal, in any unit
  class_of.amplitude = std::min(force.amplitude_N, force.variation_per_pass ? kInfinity : force.variation_N);
  class_of.rate = force.rate_N_s;
  if (!class_of.is_zero()) {
    const ResponseNorms kernel = response_norms(impulse_transfer(loop, Channel::kCommand));
    add_motion(loop, class_of, 1, kernel, 1 / loop.mass_kg, motion);
    motion.error_m = std::min(known_times(class_of.largest(), kernel.integral_abs),
                              known_times(class_of.rate, rate_gains(loop).position));
  }
  if (bias_N != 0 && !(loop.Ki > 0)) motion.error_m += std::abs(bias_N) / (loop.mass_kg * loop.Kp);
  return motion;
}

}  // namespace swarmcert::stability
