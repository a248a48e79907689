/// @file The bounds of a certification: which methods run for each claim, in which order and within which time.
#pragma once

#include "lipschitz/base/stop.h"
#include "lipschitz/base/work_progress.h"
#include "lipschitz/certify.h"

namespace swarmcert::lipschitz {

/// Returns the number of tasks that find_bounds() reports to its progress.
int pieces_of_work(const CertifyOptions& options, int bounds);

/// Proves upper bounds for `bounds`, whose `product` is set, and searches for lower bounds.
///
/// The order is: eclipse_fast(), which takes seconds at any size; then the semidefinite programs, with the slopes on
/// the box if activations other than ReLU have smaller slopes there, and the searches for lower bounds; then branch and
/// bound, on a box or if requested. Every bound is proved no matter when `stop` ends the work; bounds whose search was
/// cut short are marked as interrupted.
/// @param layers all layers of the network, with their norms.
void find_bounds(const files::Network& network, const CertifyOptions& options, const Stop& stop,
                 WorkProgress& progress, const std::vector<CertifiedLayer>& layers,
                 std::vector<CertifiedBound>& bounds);

}  // namespace swarmcert::lipschitz
