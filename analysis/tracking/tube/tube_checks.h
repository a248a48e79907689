/// @file The hypotheses that a proved tube itself implies.
#pragma once

#include "analysis/tracking/tube/local_tube.h"

namespace swarmcert::analysis {

/// Fills the whole and the assumptions of a proved tube. Withdraws `proved`, with the reason, if the errors of the tube
/// could drive an integrator to its limit.
void check_tube(const Scene& scene, LocalTube& tube);

}  // namespace swarmcert::analysis
