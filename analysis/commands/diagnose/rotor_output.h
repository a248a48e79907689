/// @file Weak rotors as results and as text.
#pragma once

#include <vector>

#include "analysis/commands/shared/ranking.h"
#include "analysis/identification/rotors/rotor_balance.h"
#include "analysis/residuals/inputs.h"

namespace swarmcert::analysis {

/// Compares the rotors of all vehicles of `inputs` with their `healthy` flights; prints one line per vehicle, and one
/// per flight that indicates another rotor, if `prints`. A rotor named for a vehicle goes to the head of the ranking as
/// rotor_thrust and makes the verdict missing_effect: a weak rotor also explains a change of the total thrust, but not
/// vice versa.
std::vector<identification::RotorBalance> judge_rotors(const residuals::Inputs& inputs,
                                                       const residuals::Inputs& healthy, int jobs,
                                                       bool prints, Judgement& judgement);
void describe_rotors(files::Record& record, const identification::RotorBalance& balance);

}  // namespace swarmcert::analysis
