/// @file What moves a vehicle beside the class of its force error: a constant force, errors of the estimates that the
/// law is given, and the error at the start. Their worst errors add to the bound of any class.
#pragma once

#include <limits>

#include "stability/bounds/loops/sampled_loop.h"

namespace swarmcert::stability {

/// What is known of the error n(t) of an estimate, in m/s for a velocity and m for a position. Infinite: nothing.
/// n is zero before t = 0, and rises from zero at the stated rate but for its constant part. A loop that samples sees
/// n once per period: `impulse` is then the period times the sum of |n| over its samples.
struct EstimateError {
  double amplitude = 0;                                        ///< sup |n|
  double rate = std::numeric_limits<double>::infinity();       ///< sup |n'|
  double variation = std::numeric_limits<double>::infinity();  ///< total variation, rise from zero included
  double impulse = std::numeric_limits<double>::infinity();    ///< int |n| dt
  /// A part that acts from t = 0 on: amplitude and impulse contain it, rate and variation do not.
  double constant = 0;
  double window_s =
      0;  ///< variation and impulse are those of any window of this length; 0: of the whole flight

  bool is_zero() const;
  /// The least bound on |n| that follows.
  double largest() const;
  bool operator==(const EstimateError& o) const {
    return amplitude == o.amplitude && rate == o.rate && variation == o.variation && impulse == o.impulse &&
           constant == o.constant && window_s == o.window_s;
  }
};

/// How the set point p_d moves. The law feeds p_d'' forward; what it cannot follow at once is an error.
struct ReferenceMotion {
  double steps_m = 0;          ///< sum of the sizes of all jumps of p_d
  double speed_steps_m_s = 0;  ///< of all jumps of p_d': a ramp begins and ends with one
  double jerk_m_s3 = 0;        ///< sup |p_d'''| between the jumps; p_d'' is zero before t = 0
  bool operator==(const ReferenceMotion& o) const {
    return steps_m == o.steps_m && speed_steps_m_s == o.speed_steps_m_s && jerk_m_s3 == o.jerk_m_s3;
  }
};

/// Of one axis. All but the bias are sizes: the signs and the course over time are the worst ones.
struct OtherErrors {
  double bias_N = 0;               ///< constant part of the force error, from t = 0 on
  double start_N = 0;              ///< |force error| at t = 0, bias included
  double position_m = 0;           ///< |e| at t = 0
  double velocity_m_s = 0;         ///< |e'| at t = 0
  EstimateError velocity_error{};  ///< estimated - true velocity
  EstimateError position_error{};  ///< estimated - true position
  ReferenceMotion reference{};
  double thrust_ratio_error =
      0;               ///< |d|: the force that acts is (1 + d) times that of the model (thrust_ratio.h)
  double hover_N = 0;  ///< the force commanded at hover along this axis, which d scales too

  /// The step that the force error makes at t = 0.
  double step_N() const;
  bool operator==(const OtherErrors& o) const {
    return bias_N == o.bias_N && start_N == o.start_N && position_m == o.position_m &&
           velocity_m_s == o.velocity_m_s && velocity_error == o.velocity_error &&
           position_error == o.position_error && reference == o.reference &&
           thrust_ratio_error == o.thrust_ratio_error && hover_N == o.hover_N;
  }
};

/// The worst error that each of them causes alone, m. The loop is linear, so they add.
struct ErrorParts {
  double bias_m = 0;     ///< of step_N()
  double initial_m = 0;  ///< of position_m and velocity_m_s
  double velocity_error_m = 0, position_error_m = 0;
  double reference_m = 0;
  double thrust_ratio_m = 0;  ///< beside what it does to the class; see thrust_ratio.h

  double total_m() const {
    return bias_m + initial_m + velocity_error_m + position_error_m + reference_m + thrust_ratio_m;
  }
};

/// All parts but thrust_ratio_m: bounds for all t >= 0 from zero integral and lags at rest; infinite where a part is
/// not zero and the loop unstable. Those of the bias are exact; that of the initial position is without a delay. Those
/// of the estimates are the least of what amplitude, rate, both together, variation and impulse of their errors give,
/// each exact for its class alone. A jump of the set point counts as an initial error of the same size. Its jerk enters
/// by the gain lag_floor().rate, exact without a delay; for a sampled loop by jerk_gain(), which contains hold, delay
/// and lags exactly (reference_jerk.h).
/// @param step_gain m/N: the edge gain of the channel by which the force error enters.
ErrorParts error_parts(const AxisLoop& loop, double step_gain, const OtherErrors& errors);
/// t = 0 is a sampling instant.
/// @param step_gain over all times.
ErrorParts error_parts(const SampledLoop& loop, double step_gain, const OtherErrors& errors);

/// sup |e(t)| after e(0) = 1, e'(0) = 0, m/m; at least 1.
double initial_position_gain(const AxisLoop& loop);
double initial_position_gain(const SampledLoop& loop);

/// What they ask of the integrator: sup |int (e + error of the estimated position) dt|, m s. Needs Ki > 0.
double integral_demand_m_s(const AxisLoop& loop, Channel channel, const OtherErrors& errors);
/// Of the state that firmware keeps. Windows of variation and impulse count by the amplitude of the error alone.
double integral_demand_m_s(const SampledLoop& loop, Channel channel, const OtherErrors& errors);

/// sup |e + n| per unit of rate of an error n of the estimated position, s: with a slow n the vehicle follows the wrong
/// position, so |e| <= sup |n| + drift_gain() sup |n'|.
double drift_gain(const AxisLoop& loop);
/// n is the error at the last sample.
double drift_gain(const SampledLoop& loop);

/// What they ask of the feedback, N: sup of its part of the commanded force, force channel.
double effort_N(const AxisLoop& loop, const OtherErrors& errors);
double effort_N(const SampledLoop& loop, const OtherErrors& errors);

}  // namespace swarmcert::stability
