/// @file Tracking error caused by float32 on the vehicle compared with the analysed double.
#pragma once

#include <string>

#include "stability/bounds/tracking_setup.h"

namespace swarmcert::stability {

/// Bounds over controller::FlightEnvelope (10 m, 5 m/s, errors up to 1 m and 3 m/s), per axis.
struct FloatErrors {
  bool applies = false;
  std::string why_not;
  double force_N[3] = {0, 0, 0};           ///< of the commanded force, each cycle
  double thrust_N = 0;                     ///< collective, what f_d errs included
  double torque_N_m[3] = {0, 0, 0};        ///< of the attitude law; stays within the attitude loop
  double integral_m_s[3] = {0, 0, 0};      ///< of the integrator, each cycle
  double tracking_error_m[3] = {0, 0, 0};  ///< of both, at all times; infinite where nothing bounds it
};

/// The command errs by force_N, the thrust along the body's axis by thrust_N: the larger counts, as an amplitude; what
/// the integrator loses acts on the command through m Ki and grows by as much in each cycle, a rate. Both enter the
/// command channel: of the sampled loop where there is a rate, else of the continuous one with a cycle of 2 ms.
FloatErrors float_errors(const TrackingSetup& input, const stability::TrackingReport& report);

}  // namespace swarmcert::stability
