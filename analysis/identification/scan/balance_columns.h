/// @file Residuals of the torque and of the force of each rotor.
#pragma once

#include <Eigen/Core>

#include "analysis/residuals/inputs.h"

namespace swarmcert::identification {

/// Returns the residuals of a track at each record, [7 x records]: the torque about the body axes in N m, then, for
/// each rotor, the excess force along b3 in newton that would cause this torque and the residual force along b3 (the
/// inverse of the mixing matrix applied to both). NaN where the angular acceleration is unknown.
///
/// The rotor entries are zero if there are not four rotors or the log does not allow a force to be judged. There are no
/// columns if the log has no rates or does not give the force of each rotor.
Eigen::MatrixXd balance_columns(const stability::Model& model, const residuals::Inputs& inputs,
                                const residuals::Track& track);

}  // namespace swarmcert::identification
