/// @file The position loop as firmware runs it: sampled, zero-order hold, any integrator step.
#pragma once

#include <optional>

#include "stability/bounds/loops/attitude_cascade.h"
#include "stability/bounds/loops/axis_loop.h"

namespace swarmcert::stability {

/// Every period: measure e and e'; I += integrator_step_s e; command -m (Kp e + Kd e' + Ki I), held until the next
/// command, delayed by plant.delay_s (not necessarily whole periods) and passed through plant.lags_s. With an attitude
/// loop, the command is the acceleration of a tilt, towards which a torque behind the lags turns the vehicle.
struct SampledLoop {
  AxisLoop plant;  ///< Ki as written in the firmware, not the effective one
  double period_s = 0;
  double integrator_step_s = 0;
  std::optional<AttitudeLoop> attitude = {};  ///< in continuous time
  double body_rate_lag_s = 0;                 ///< with `attitude`
};

/// Returns Ki integrator_step_s / period_s, the equivalent continuous gain of the sampled integrator.
double effective_Ki(const SampledLoop& loop);

/// The times at which tracking errors count.
enum class Instants {
  kSampling,  ///< the times at which the loop measures
  kAll,  ///< also between them; for the shipped gains impulse is up to 4e-4 larger, amplitude and edge 1e-4
};

/// Returns the exact norms of the sampled loop. Channel kForce: a disturbance in continuous time. Channel kCommand: an
/// error that the loop adds to its command once per period; `rate` then means |eps_k - eps_(k-1)| <= period, `impulse`
/// period sum|eps_k| <= 1. Computed by the adjoint: the kernel is a polynomial on each period before the output's time,
/// and its sign changes are roots of that polynomial. Relative error at one phase of the period about 1e-10. With kAll
/// the worst phase is searched on eight phases and refined, which may miss some 1e-5 of lightly damped loops. All
/// infinite if the spectral radius is not below 1.
GainNorms sampled_norms(const SampledLoop& loop, Channel channel, Instants instants);

/// The same for an error of an estimate, which the loop reads once per period, per m/s or per m.
GainNorms sampled_norms(const SampledLoop& loop, Estimate estimate, Instants instants);

/// The same calls for both kinds of loop: the gains at all times, and the parameters.
template <class Input>
GainNorms norms_of(const AxisLoop& loop, Input input) {
  return continuous_norms(loop, input);
}
template <class Input>
GainNorms norms_of(const SampledLoop& loop, Input input) {
  return sampled_norms(loop, input, Instants::kAll);
}
inline AxisLoop& plant_of(AxisLoop& loop) { return loop; }
inline AxisLoop& plant_of(SampledLoop& loop) { return loop.plant; }
inline const AxisLoop& plant_of(const AxisLoop& loop) { return loop; }
inline const AxisLoop& plant_of(const SampledLoop& loop) { return loop.plant; }

/// Returns |u|_oo per |f|_oo for the feedback part u of the commanded force, N/N (force channel).
double effort_gain(const SampledLoop& loop);

/// Returns the largest modulus of an eigenvalue of the map from one sample to the next.
double spectral_radius(const SampledLoop& loop);

/// Standard deviation of e at the sampling times, m, under white measurement noise of standard deviations `position_m`
/// and `velocity_m_s` per sample (discrete Lyapunov equation); `command_m_s2` is that of the commanded acceleration.
/// Infinite if the loop is unstable.
struct NoiseDeviation {
  double error_m = 0;
  double command_m_s2 = 0;
};
NoiseDeviation noise_deviation(const SampledLoop& loop, double position_m, double velocity_m_s);

}  // namespace swarmcert::stability
