/// @file Force errors inside a proved tube, and the hypotheses that the tube itself implies.
#pragma once

#include "analysis/tracking/tube/local_tube.h"

namespace swarmcert::analysis {

/// Fills bounds, slices and assumptions of a proved tube. Withdraws `proved`, with the reason, if the errors of the
/// tube could drive an integrator to its limit.
/// @param constants per vehicle, valid in the tube; used for rates; empty: unknown.
void check_tube(const Scene& scene, const std::vector<ForceConstants>& constants, LocalTube& tube);

}  // namespace swarmcert::analysis
