/// @file Lipschitz constants of the network's force on vehicles that fly a task: everywhere, and within a tube.
#pragma once

#include <atomic>
#include <functional>
#include <vector>

#include "analysis/tracking/tube/force_bound.h"

namespace swarmcert::analysis {

struct GlobalConstants {
  ForceConstants product;  ///< products of spectral norms
  ForceConstants sdp;      ///< LipSDP, of the position's and of the velocity's inputs; at most the product
  std::vector<double> position_t, velocity_t;  ///< multipliers of the neighbour's bounds, for local ones
};

/// In newton per m and m/s, for all inputs.
GlobalConstants global_constants(const files::Network& network, const LearnedForce& learned,
                                 const std::atomic<bool>* cancelled);

/// Per vehicle, for neighbours anywhere in its tube: branch and bound with LipSDP over the hull of all stretches, whose
/// proof check::check_tree() has accepted; the global constant where that is smaller or nothing was proved.
/// @param nodes boxes per constant.
std::vector<ForceConstants> local_constants(const files::Network& network, const Scene& scene,
                                            const Radii& radii, const GlobalConstants& global, int nodes,
                                            int jobs, const std::atomic<bool>* cancelled,
                                            const std::function<void(int done, int total)>& progress);

}  // namespace swarmcert::analysis
