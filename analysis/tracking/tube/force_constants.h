/// @file Lipschitz constants of the network's force on vehicles that fly a task: globally, and within a tube.
#pragma once

#include <atomic>
#include <functional>
#include <vector>

#include "analysis/tracking/tube/force_bound.h"

namespace swarmcert::analysis {

struct GlobalConstants {
  ForceConstants product;  ///< products of spectral norms
  ForceConstants sdp;      ///< LipSDP for the position inputs and the velocity inputs; at most the product
  std::vector<double> position_t, velocity_t;  ///< multipliers of a neighbour's bounds, for local ones
};

/// Returns constants in newton per m and m/s, valid for all inputs.
GlobalConstants global_constants(const files::Network& network, const LearnedForce& learned,
                                 const std::atomic<bool>* cancelled);

/// Returns constants per vehicle, for neighbours anywhere in its tube: branch and bound with LipSDP over the hull of
/// all stretches, with a proof accepted by check::check_tree(); the global constant if that is smaller or nothing was
/// proved.
/// @param nodes boxes per constant.
std::vector<ForceConstants> local_constants(const files::Network& network, const Scene& scene,
                                            const Radii& radii, const GlobalConstants& global, int nodes,
                                            int jobs, const std::atomic<bool>* cancelled,
                                            const std::function<void(int done, int total)>& progress);

}  // namespace swarmcert::analysis
