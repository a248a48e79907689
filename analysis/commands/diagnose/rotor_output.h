/// @file Weak rotors as JSON and as text.
#pragma once

#include <vector>

#include "analysis/identification/rotors/rotor_balance.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {

/// Prints one line per vehicle, and one per flight that indicates another rotor than all flights of the vehicle
/// together.
void print_rotors(const std::vector<identification::RotorBalance>& balances);

/// Adds `rotors`: per vehicle and flight, the thrust of each rotor relative to healthy flights. A rotor named for a
/// vehicle goes to the head of `ranking` as rotor_thrust and makes the verdict missing_effect: a weak rotor also
/// explains a change of the total thrust, but not vice versa.
/// @param kind kind of the vehicles
/// @return whether a rotor is named.
bool add_rotors(const std::vector<identification::RotorBalance>& balances, const std::string& kind,
                files::Json& result);

/// Compares the rotors of all vehicles of `inputs` with their `healthy` flights and calls add_rotors(), and
/// print_rotors() if `prints`. Returns whether a rotor is named.
bool judge_rotors(const residuals::Inputs& inputs, const residuals::Inputs& healthy, int jobs, bool prints,
                  files::Json& result);

}  // namespace swarmcert::analysis
