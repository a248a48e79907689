/// @file Centres of mass and constant torques as JSON and as text.
#pragma once

#include "analysis/residuals/inputs.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {

/// Adds `torque_balance`: per vehicle, the mean torque that its rotors balance. A significant torque is appended to
/// `ranking` as com_offset or torque_bias, and makes the verdict missing_effect. Prints the balance if `prints`.
/// @return whether an entry was added to the ranking.
bool judge_torques(const residuals::Inputs& inputs, int jobs, bool prints, files::Json& result);

/// Adds `sensors`: per vehicle, its accelerometer compared with its velocity. A significant scale goes to the head of
/// `ranking` as accelerometer_scale, replaces a thrust_ratio that it explains, and makes the verdict missing_effect.
/// Prints the comparison if `prints`.
/// @return whether an entry was added to the ranking.
bool judge_accelerometers(const residuals::Inputs& inputs, int jobs, bool prints, files::Json& result);

/// Adds the signals of logs that contradict each other to `problems`, with estimates and their 99 % intervals.
/// @return whether the verdict must not be nothing_missing: a model has no effect that corrects a sensor.
bool judge_motions(const residuals::Inputs& inputs, int jobs, files::Json& result);

}  // namespace swarmcert::analysis
