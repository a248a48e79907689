/// @file Disturbances as files declare them: the tables of a policy and of grid.toml, and disturbance.toml.
#pragma once

#include <string>

#include "nn/base/file_keys.h"
#include "nn/base/toml.h"
#include "stability/bounds/disturbance_source.h"

namespace swarmcert::stability {

/// Describes rate_N_s, amplitude_N, variation_N and impulse_N_s: classes of the force error. Every value is one number
/// for all axes, or a list of x, y and z.
void describe_classes(files::Keys& keys);
/// Likewise, with bias_N.
void describe_force_error(files::Keys& keys);
void describe_disturbance_file(files::Keys& keys);

/// Adds the classes and bias_N that the table states; what it leaves out stays. The kind is then "declared".
/// @throws files::InputError for negative numbers, and for lists of another length.
void read_force_error(const files::TomlTable& table, DisturbanceSource& source);

/// Adds what disturbance.toml states.
/// @throws files::InputError with line, key, value and hint.
void read_disturbance_file(const std::string& path, DisturbanceSource& source);

}  // namespace swarmcert::stability
