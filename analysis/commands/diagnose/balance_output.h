/// @file Centres of mass and constant torques as JSON and as text.
#pragma once

#include "analysis/residuals/inputs.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {

/// `torque_balance`: per vehicle what its rotors balance on average. What counts goes to the end of `ranking` as
/// com_offset or torque_bias, and makes the verdict missing_effect. Prints it where `prints`.
/// @return whether something is named.
bool judge_torques(const residuals::Inputs& inputs, int jobs, bool prints, files::Json& result);

/// `sensors`: per vehicle its accelerometer against its velocity. What counts goes to the head of `ranking` as
/// accelerometer_scale, in place of a thrust_ratio that it explains, and makes the verdict missing_effect. Prints it
/// where `prints`.
/// @return whether something is named.
bool judge_accelerometers(const residuals::Inputs& inputs, int jobs, bool prints, files::Json& result);

}  // namespace swarmcert::analysis
