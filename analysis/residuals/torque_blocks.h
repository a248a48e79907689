/// @file What balances the rotors' torques on average, from logs of any rate.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "analysis/residuals/track.h"
#include "stability/model.h"

namespace swarmcert::residuals {

/// Means over a stretch of flight without a cut.
struct TorqueBlock {
  double thrust_N = 0;  ///< of the rotors, apply_model()
  /// tau_a that balances the rotors: J omega' + omega x J omega - tau_u less the torque of the model's effects.
  Eigen::Vector3d torque_B_Nm = Eigen::Vector3d::Zero();
};

/// One after the other, each of at least `duration_s`. Over a second the mean of omega' is known from its ends, so that
/// logs of any rate do; without rates it counts as zero. Empty where the log does not say the force of each rotor.
/// @throws files::InputError where an effect of the model cannot be made.
std::vector<TorqueBlock> torque_blocks(const stability::Model& model, const Kinds& kinds, const Track& track,
                                       double duration_s);

}  // namespace swarmcert::residuals
