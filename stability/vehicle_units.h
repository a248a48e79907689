/// @file Numbers of [vehicle] that no multirotor has: they were written in another unit.
#pragma once

#include "nn/base/toml.h"
#include "stability/model.h"

namespace swarmcert::stability {

/// Compares thrust with weight and the inertia's radius of gyration with the arm. Where they do not fit, the field
/// whose usual other unit (gram, millimetre, g cm^2, percent or counts of PWM) makes them fit is refused.
/// @param vehicle the table that `model` was read from.
/// @throws files::InputError naming field, value and the unit that was probably meant.
void check_vehicle_units(const files::TomlTable& vehicle, const Model& model);

}  // namespace swarmcert::stability
