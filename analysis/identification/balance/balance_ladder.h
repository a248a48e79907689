/// @file Adds effects that are identified from means over a second: com_offset, torque_bias or accelerometer_scale.
#pragma once

#include <string>

#include "analysis/identification/ladder.h"

namespace swarmcert::identification {

/// Returns true if `effect` is fitted to mean torques (torque_balance.h) and not to the force in flight.
bool is_of_torques(const std::string& effect);
/// Returns true if `effect` is fitted to mean torques or to mean accelerations (accelerometer_balance.h).
bool is_balanced(const std::string& effect);

/// Like climb() for this single effect. The errors of the rows are, for torques, the forces by which the rotors are out
/// of balance, rms over blocks of 1 s and rotors; for accelerometer_scale, the errors of the force. If several vehicles
/// flew, each gets an effect of its own. Precondition: is_balanced(effect).
Ladder balance_ladder(residuals::Inputs inputs, const std::string& effect, bool keep_anyway, int jobs);

}  // namespace swarmcert::identification
