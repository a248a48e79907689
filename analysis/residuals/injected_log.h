/// @file Injects a known effect into recorded flights, as the accelerometer would have measured it.
#pragma once

#include <vector>

#include "analysis/residuals/inputs.h"
#include "stability/simulation/flight_log.h"

namespace swarmcert::residuals {

/// Returns the records of `track` with the force of its model's effects added to the specific force, after the model's
/// accelerometer filter and divided by the model's mass: a' = a + (F_with - F_without) / m. The injection is open loop:
/// positions, attitudes and commands stay as recorded, although in flight the controller would have reacted. Commanded
/// thrust and torque are dropped, because no command of this project reads them from logs. Precondition: the track is
/// not position only.
std::vector<stability::LogRecord> injected_log(const Inputs& inputs, const Track& track);

}  // namespace swarmcert::residuals
