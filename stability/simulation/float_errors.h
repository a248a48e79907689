/// @file Tracking error caused by the vehicle's float32 arithmetic, relative to the analysed law.
#pragma once

#include <string>

#include "stability/bounds/tracking_bounds.h"

namespace swarmcert::stability {

/// Error bounds, per axis, valid over controller::FlightEnvelope (10 m, 5 m/s, errors up to 1 m and 3 m/s).
struct FloatErrors {
  bool applies = false;
  std::string why_not;
  double force_N[3] = {0, 0, 0};           ///< of the commanded force, each cycle
  double thrust_N = 0;                     ///< collective, including the error of f_d
  double torque_N_m[3] = {0, 0, 0};        ///< of the attitude law; acts only within the attitude loop
  double integral_m_s[3] = {0, 0, 0};      ///< of the integrator, each cycle
  double tracking_error_m[3] = {0, 0, 0};  ///< due to force and integral, at all times; infinite if unbounded
};

/// Propagates round-off errors to the tracking error. The command's error is force_N and the error of the thrust along
/// the body axis is thrust_N; the larger of the two is an amplitude bound. The integrator's error acts on the command
/// through m Ki and grows by the same amount in each cycle, which is a rate bound. Both enter the command channel: of
/// the sampled loop if there is a rate, else of the continuous loop with a cycle of 2 ms.
FloatErrors float_errors(const FlownLoop& input, const stability::TrackingReport& report);

}  // namespace swarmcert::stability
