/// @file Weak rotors as JSON and as text.
#pragma once

#include <vector>

#include "analysis/identification/rotors/rotor_balance.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {

/// One line per vehicle, and one per flight that names another rotor than the vehicle's flights together.
void print_rotors(const std::vector<identification::RotorBalance>& balances);

/// `rotors`: per vehicle and flight what each rotor gives against healthy flights. What is named for a vehicle goes to
/// the head of `ranking` as rotor_thrust, and makes the verdict missing_effect: a weak rotor changes the thrust as a
/// whole as well, not the other way round.
/// @param kind of the vehicles
/// @return whether a rotor is named.
bool add_rotors(const std::vector<identification::RotorBalance>& balances, const std::string& kind,
                files::Json& result);

/// Compares the rotors of all vehicles of `inputs` with their `healthy` flights; add_rotors(), and print_rotors() where
/// `prints`. Returns whether a rotor is named.
bool judge_rotors(const residuals::Inputs& inputs, const residuals::Inputs& healthy, int jobs, bool prints,
                  files::Json& result);

}  // namespace swarmcert::analysis
