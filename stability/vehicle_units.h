/// @file Detects numbers of [vehicle] that were written in the wrong unit.
#pragma once

#include "nn/base/toml.h"
#include "stability/model.h"

namespace swarmcert::stability {

/// Compares the thrust with the weight and the radius of gyration with the arm. If they are implausible, the field that
/// becomes plausible in another common unit (gram, millimetre, g cm^2, percent or PWM counts) is rejected.
/// @param vehicle the table from which `model` was read.
/// @throws files::InputError naming the field, its value and the unit that was probably meant.
void check_vehicle_units(const files::TomlTable& vehicle, const Model& model);

}  // namespace swarmcert::stability
