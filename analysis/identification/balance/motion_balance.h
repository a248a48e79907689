/// @file Compares positions, velocities, attitudes, rates and specific forces of one log with one another.
///
/// They all describe one rigid body, whatever forces act on it. A turned or tilted frame, a wrong scale or a late
/// signal therefore shows without a model of the vehicle. The residual force hides most of these faults, because an
/// attitude that errs turns the measured and the modelled force alike.
#pragma once

#include <string>
#include <vector>

#include "analysis/residuals/inputs.h"

namespace swarmcert::identification {

/// A contradiction between two signals of a vehicle's logs.
struct MotionFault {
  std::string kind, vehicle;
  std::string quantity;  ///< "velocity_scale", "position_lag_s", ...: see motion_faults()
  double value = 0;
  double half = 0;    ///< of its 99 % interval
  std::string words;  ///< the estimate and its interval, with units
};

/// Returns the contradictions per vehicle of `kind` whose 99 % interval is beyond the size that matters:
/// - velocity_scale: velocities over differences of positions, off by 2 %;
/// - position_lag_s: positions later than velocities by 10 ms;
/// - velocity_lag_s: velocities later than attitudes and specific forces by 10 ms;
/// - attitude_lag_s: attitudes later than rates by 10 ms;
/// - heading_rad: velocities turned anticlockwise about the vertical against attitudes by 3 degrees;
/// - tilt_rad: specific forces tilted against changes of velocities by 2 degrees.
/// The independent units are flights or, if there are fewer than five, parts of 10 s. Positions and velocities of which
/// one is derived from the other are not compared. The result does not depend on `jobs`.
std::vector<MotionFault> motion_faults(const residuals::Inputs& inputs, const std::string& kind, int jobs);

/// The same for tracks of one vehicle that measure velocities, without kind and name of the vehicle.
std::vector<MotionFault> motion_faults(const std::vector<residuals::Track>& tracks);

}  // namespace swarmcert::identification
