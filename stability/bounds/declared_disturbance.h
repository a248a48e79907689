/// @file Disturbances as files declare them: the tables of a policy and of grid.toml, and disturbance.toml.
#pragma once

#include <string>
#include <vector>

#include "nn/base/toml.h"
#include "stability/bounds/disturbance_source.h"

namespace swarmcert::stability {

/// Returns rate_N_s (sup |f'|), amplitude_N (sup |f|), variation_N (total variation of f) and impulse_N_s (int |f| dt
/// of one pass): classes of the force error f. Every value is one number for all axes, or a list of x, y and z.
std::vector<std::string> class_keys();

/// Adds the classes and bias_N that the table states; what it leaves out stays. The kind is then "declared".
/// @throws files::InputError for negative numbers, and for lists of another length.
void read_force_error(const files::TomlTable& table, DisturbanceSource& source);

/// Adds what disturbance.toml (schema swarmcert/disturbance/1) states:
///   the classes and bias_N; thrust_ratio_error; passes, every_s, pass_length_s
///   velocity_error_m_s, velocity_error_rate_m_s2, velocity_error_variation_m_s, velocity_error_impulse_m
///   position_error_m, position_error_rate_m_s, position_error_variation_m, position_error_impulse_m_s
///   reference_step_m, reference_speed_step_m_s, reference_accel_m_s2, reference_jerk_m_s3
/// @throws files::InputError with line, key, value and hint.
void read_disturbance_file(const std::string& path, DisturbanceSource& source);

}  // namespace swarmcert::stability
