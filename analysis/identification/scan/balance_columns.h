/// @file What is left of the torque, and of the force of each rotor.
#pragma once

#include <Eigen/Core>

#include "analysis/residuals/inputs.h"

namespace swarmcert::identification {

/// Residuals of one track at each record, [7 x records]: torque about the body's axes in N m, then the forces in newton
/// that the rotors would have to give too much, each along b3, to be the cause of this torque and of what is left of
/// the force along b3: the inverse of the mixing matrix times both. NaN where the change of the rates is unknown.
///
/// Rotors are zero where there are not four of them, or the log lets no force be judged. No columns where the log has
/// no rates or does not say the force of each rotor.
Eigen::MatrixXd balance_columns(const stability::Model& model, const residuals::Inputs& inputs,
                                const residuals::Track& track);

}  // namespace swarmcert::identification
