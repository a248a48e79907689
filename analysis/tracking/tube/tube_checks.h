/// @file Force errors inside a proved tube, and the hypotheses that the tube itself proves.
#pragma once

#include "analysis/tracking/tube/local_tube.h"

namespace swarmcert::analysis {

/// Fills bounds, slices and assumptions of a proved tube. Takes `proved` back, with the reason, where the tube's own
/// errors could drive an integrator to its limit.
/// @param constants per vehicle, that hold in the tube, for rates; empty: none are known.
void check_tube(const Scene& scene, const std::vector<ForceConstants>& constants, LocalTube& tube);

}  // namespace swarmcert::analysis
