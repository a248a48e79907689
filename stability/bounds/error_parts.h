/// @file What moves a vehicle beside the class of its force error: a constant force, errors of the estimates that the
/// law is given, and the error at the start. Their worst errors add to the bound of any class.
#pragma once

#include "stability/bounds/sampled_loop.h"

namespace swarmcert::stability {

/// Of one axis. All but the bias are sizes: the signs and the course over time are the worst ones.
struct OtherErrors {
  double bias_N = 0;              ///< constant part of the force error, from t = 0 on
  double start_N = 0;             ///< |force error| at t = 0, bias included
  double position_m = 0;          ///< |e| at t = 0
  double velocity_m_s = 0;        ///< |e'| at t = 0
  double velocity_error_m_s = 0;  ///< sup |estimated - true velocity|
  double position_error_m = 0;    ///< sup |estimated - true position|

  /// The step that the force error makes at t = 0.
  double step_N() const;
  bool operator==(const OtherErrors& o) const {
    return bias_N == o.bias_N && start_N == o.start_N && position_m == o.position_m &&
           velocity_m_s == o.velocity_m_s && velocity_error_m_s == o.velocity_error_m_s &&
           position_error_m == o.position_error_m;
  }
};

/// The worst error that each of them causes alone, m. The loop is linear, so they add.
struct ErrorParts {
  double bias_m = 0;     ///< of step_N()
  double initial_m = 0;  ///< of position_m and velocity_m_s
  double velocity_error_m = 0, position_error_m = 0;

  double total_m() const { return bias_m + initial_m + velocity_error_m + position_error_m; }
};

/// Bounds for all t >= 0 from zero integral and lags at rest; infinite where a part is not zero and the loop unstable.
/// Those of the bias and of the estimates are exact; that of the initial position is without a delay.
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
/// Of the state that firmware keeps.
double integral_demand_m_s(const SampledLoop& loop, Channel channel, const OtherErrors& errors);

/// What they ask of the feedback, N: sup of its part of the commanded force, force channel.
double effort_N(const AxisLoop& loop, const OtherErrors& errors);

}  // namespace swarmcert::stability
