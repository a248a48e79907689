/// @file Estimates of how far the signals of one track contradict each other.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "analysis/residuals/track.h"

namespace swarmcert::identification {

/// Least squares estimates from one part of a track, by name. An estimate is missing if the part is too short or does
/// not determine it.
/// - least_velocity_scale, largest_velocity_scale: bounds on velocities over differences of positions, whatever noise
///   the two have;
/// - position_lag_s: positions later than velocities;
/// - heading_rad: velocities turned about the vertical, anticlockwise seen from above, against attitudes and specific
///   forces;
/// - velocity_lag_s: velocities later than attitudes and specific forces, along the horizontal;
/// - tilt_x_W, tilt_y_W, tilt_x_B, tilt_y_B: horizontal acceleration over g that the specific force lacks, constant in
///   W or in the body; square_W, square_B: mean square of what each of the two leaves, m^2/s^4;
/// - attitude_lag_s: attitudes later than rates.
using MotionEstimates = std::map<std::string, double>;

/// Returns the estimates from each part of at least `part_s`, or from the whole track if it is infinite. Differences
/// are taken over 0.5 s (attitudes: 0.1 s) without cuts.
/// @param measures_velocity residuals::measures_velocity() of the log: only then velocities are compared
std::vector<MotionEstimates> motion_estimates(const residuals::Track& track, bool measures_velocity,
                                              double part_s);

}  // namespace swarmcert::identification
