/// @file Bounds on errors that add to those of the force error's class: a constant force, errors of the estimates
/// used by the law, initial errors, and motion of the reference. They add to the bound of any class.
#pragma once

#include <limits>

#include "stability/bounds/loops/sampled_loop.h"

namespace swarmcert::stability {

/// Known bounds on the error n(t) of an estimate, in m/s for a velocity and m for a position. Infinite: unknown. n is
/// zero before t = 0 and, except for its constant part, rises from zero at the stated rate. A sampled loop sees n once
/// per period: `impulse` is then the period times the sum of |n| over its samples.
struct EstimateError {
  double amplitude = 0;                                        ///< sup |n|
  double rate = std::numeric_limits<double>::infinity();       ///< sup |n'|
  double variation = std::numeric_limits<double>::infinity();  ///< total variation, rise from zero included
  double impulse = std::numeric_limits<double>::infinity();    ///< int |n| dt
  /// A part that acts from t = 0 on; included in amplitude and impulse, but not in rate and variation.
  double constant = 0;
  /// Variation and impulse are those of any window of this length; 0: of the whole flight.
  double window_s = 0;

  bool is_zero() const;
  /// Returns the smallest bound on |n| that follows.
  double largest() const;
  bool operator==(const EstimateError& o) const {
    return amplitude == o.amplitude && rate == o.rate && variation == o.variation && impulse == o.impulse &&
           constant == o.constant && window_s == o.window_s;
  }
};

/// Motion of the setpoint p_d. The law feeds p_d'' forward; motion that the loop cannot follow at once is an error.
struct ReferenceMotion {
  double steps_m = 0;          ///< sum of the sizes of all jumps of p_d
  double speed_steps_m_s = 0;  ///< of all jumps of p_d', such as the start and the end of a ramp
  double jerk_m_s3 = 0;        ///< sup |p_d'''| between the jumps; p_d'' is zero before t = 0
  double acceleration_m_s2 =
      std::numeric_limits<double>::infinity();  ///< sup |p_d''|; needs a jerk to be nonzero
  /// Returns sup of the acceleration that is fed forward.
  double fed_forward_m_s2() const { return jerk_m_s3 == 0 ? 0 : acceleration_m_s2; }
  bool operator==(const ReferenceMotion& o) const {
    return steps_m == o.steps_m && speed_steps_m_s == o.speed_steps_m_s && jerk_m_s3 == o.jerk_m_s3 &&
           acceleration_m_s2 == o.acceleration_m_s2;
  }
};

/// Errors on one axis. All except the bias are magnitudes: signs and time histories are assumed to be the worst.
struct OtherErrors {
  double bias_N = 0;               ///< constant part of the force error, from t = 0 on
  double start_N = 0;              ///< |force error| at t = 0, bias included
  double position_m = 0;           ///< |e| at t = 0
  double velocity_m_s = 0;         ///< |e'| at t = 0
  EstimateError velocity_error{};  ///< estimated - true velocity
  EstimateError position_error{};  ///< estimated - true position
  ReferenceMotion reference{};
  /// |d|: the actual force is (1 + d) times that of the model (thrust_ratio.h).
  double thrust_ratio_error = 0;
  double hover_N = 0;  ///< the force commanded at hover along this axis, also scaled by d

  /// Returns the size of the force error's step at t = 0.
  double step_N() const;
  bool operator==(const OtherErrors& o) const {
    return bias_N == o.bias_N && start_N == o.start_N && position_m == o.position_m &&
           velocity_m_s == o.velocity_m_s && velocity_error == o.velocity_error &&
           position_error == o.position_error && reference == o.reference &&
           thrust_ratio_error == o.thrust_ratio_error && hover_N == o.hover_N;
  }
};

/// The worst error that each part causes alone, m. The loop is linear, so the parts add.
struct ErrorParts {
  double bias_m = 0;     ///< due to step_N()
  double initial_m = 0;  ///< due to position_m and velocity_m_s
  double velocity_error_m = 0, position_error_m = 0;
  double reference_m = 0;
  double thrust_ratio_m = 0;  ///< in addition to its effect on the class; see thrust_ratio.h

  double total_m() const {
    return bias_m + initial_m + velocity_error_m + position_error_m + reference_m + thrust_ratio_m;
  }
};

/// Returns all parts except thrust_ratio_m: bounds for all t >= 0, starting with zero integral and lags at rest;
/// infinite if a part is nonzero and the loop unstable. Those of the bias are exact; that of the initial position is
/// exact without a delay. Those of the estimates are the smallest of the bounds from amplitude, rate, both together,
/// variation and impulse of their errors, each of which is exact for its own class. A jump of the setpoint is treated
/// as an initial error of the same size. Its jerk enters by the gain lag_floor().rate, which is exact without a delay;
/// for a sampled loop by jerk_gain(), which takes hold, delay and lags into account exactly (reference_jerk.h).
/// @param step_gain m/N: the edge gain of the channel by which the force error enters.
ErrorParts error_parts(const AxisLoop& loop, double step_gain, const OtherErrors& errors);
/// The same for a sampled loop; t = 0 is a sampling instant.
/// @param step_gain over all times.
ErrorParts error_parts(const SampledLoop& loop, double step_gain, const OtherErrors& errors);

/// Returns sup |e(t)| after e(0) = 1, e'(0) = 0, in m/m; at least 1.
double initial_position_gain(const AxisLoop& loop);
double initial_position_gain(const SampledLoop& loop);

/// Returns the demand of these errors on the integrator: sup |int (e + error of the estimated position) dt|, m s.
/// Requires Ki > 0.
double integral_demand_m_s(const AxisLoop& loop, Channel channel, const OtherErrors& errors);
/// The same for the integrator state of the firmware. Variation and impulse given for windows are ignored; only the
/// amplitude of the error counts.
double integral_demand_m_s(const SampledLoop& loop, Channel channel, const OtherErrors& errors);

/// Returns sup |e + n| per unit of rate of an error n of the estimated position, s: for a slow n the vehicle follows
/// the wrong position, so |e| <= sup |n| + drift_gain() sup |n'|.
double drift_gain(const AxisLoop& loop);
/// The same for a sampled loop; n is the error at the last sample.
double drift_gain(const SampledLoop& loop);

/// Returns the demand of these errors on the commanded force beside weight and feedforward, N; a step of the force
/// error enters by `channel`.
double effort_N(const AxisLoop& loop, const OtherErrors& errors, Channel channel = Channel::kForce);
double effort_N(const SampledLoop& loop, const OtherErrors& errors, Channel channel = Channel::kForce);

}  // namespace swarmcert::stability
