/// @file Centres of mass, constant torques and accelerometers as results and as text.
#pragma once

#include <string>
#include <vector>

#include "analysis/commands/shared/ranking.h"
#include "analysis/identification/balance/accelerometer_balance.h"
#include "analysis/identification/balance/torque_balance.h"
#include "analysis/residuals/inputs.h"

namespace swarmcert::analysis {

/// Returns, per vehicle, the mean torque that its rotors balance. A significant torque is appended to the ranking as
/// com_offset or torque_bias. Prints the balance if `prints`.
std::vector<identification::TorqueBalance> judge_torques(const residuals::Inputs& inputs, int jobs,
                                                         bool prints, Judgement& judgement);
void describe_torques(files::Record& record, const identification::TorqueBalance& balance);

/// Returns, per vehicle, its accelerometer compared with its velocity. A significant scale goes to the head of the
/// ranking as accelerometer_scale, and replaces a thrust_ratio that it explains. Prints the comparison if `prints`.
std::vector<identification::AccelerometerBalance> judge_accelerometers(const residuals::Inputs& inputs,
                                                                       int jobs, bool prints,
                                                                       Judgement& judgement);
void describe_accelerometer(files::Record& record, const identification::AccelerometerBalance& balance);

/// Adds the signals of logs that contradict each other to `problems`, with estimates and their 99 % intervals. Unless
/// the model has an effect that corrects a sensor, nothing_missing becomes unexplained.
void judge_motions(const residuals::Inputs& inputs, int jobs, Judgement& judgement,
                   std::vector<std::string>& problems);

}  // namespace swarmcert::analysis
