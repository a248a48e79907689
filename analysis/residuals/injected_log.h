/// @file Injection of a known effect into recorded flights, as the accelerometer would have measured it.
#pragma once

#include <vector>

#include "analysis/residuals/inputs.h"
#include "stability/simulation/flight_log.h"

namespace swarmcert::residuals {

/// The records of `track` with the force of its model's effects, behind the model's accelerometer filter, over the
/// model's mass added to the specific force: a' = a + (F_with - F_without) / m. Open loop: positions, attitudes and
/// commands stay as recorded; in flight the controller would have answered.
/// Of commanded thrust and torque, which no command of this project reads from logs, nothing is kept.
/// Precondition: the track is not position only.
std::vector<stability::LogRecord> injected_log(const Inputs& inputs, const Track& track);

}  // namespace swarmcert::residuals
