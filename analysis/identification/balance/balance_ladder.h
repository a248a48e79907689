/// @file Adding what means over a second show to a model: com_offset, torque_bias or accelerometer_scale.
#pragma once

#include <string>

#include "analysis/identification/ladder.h"

namespace swarmcert::identification {

/// Whether `effect` is fitted to mean torques (torque_balance.h) and not to the force of a flight.
bool is_of_torques(const std::string& effect);
/// Whether it is fitted to these or to mean accelerations (accelerometer_balance.h).
bool is_balanced(const std::string& effect);

/// As climb(), for the one effect. Errors of the rows are, of torques, forces by which the rotors are off balance, rms
/// over blocks of 1 s and rotors; of accelerometer_scale those of the force. Where several vehicles fly each gets an
/// effect of its own. Precondition: is_balanced(effect).
Ladder balance_ladder(const residuals::Inputs& inputs, const std::string& effect, bool keep_anyway, int jobs);

}  // namespace swarmcert::identification
