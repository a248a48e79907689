/// @file Mean torques that balance the rotors, from logs of any rate.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "analysis/residuals/track.h"
#include "stability/model.h"

namespace swarmcert::residuals {

/// Means over a stretch of flight without cuts.
struct TorqueBlock {
  double thrust_N = 0;  ///< of the rotors, from apply_model()
  /// tau_a that balances the rotors: J omega' + omega x J omega - tau_u minus the torque of the model's effects.
  Eigen::Vector3d torque_B_Nm = Eigen::Vector3d::Zero();
};

/// Returns consecutive blocks of at least `duration_s`. Over a second the mean of omega' follows from the rates at its
/// ends, so any log rate is sufficient; without rates it is taken as zero. Empty if the log does not give the force of
/// each rotor.
/// @throws files::InputError if an effect of the model cannot be created.
std::vector<TorqueBlock> torque_blocks(const stability::Model& model, const Kinds& kinds, const Track& track,
                                       double duration_s);

}  // namespace swarmcert::residuals
