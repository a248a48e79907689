/// @file The bounds of a certification: what is done for each claim, in which order, within which time.
#pragma once

#include "lipschitz/certify.h"
#include "lipschitz/stop.h"
#include "lipschitz/work_progress.h"

namespace swarmcert::lipschitz {

/// Pieces of work that find_bounds() gives to its progress.
int pieces_of_work(const CertifyOptions& options, int bounds);

/// Proves upper bounds for `bounds`, whose `product` is set, and searches for lower ones: first what takes seconds at
/// any size, eclipse_fast(); then the semidefinite programs, with the slopes on the box where other activations than
/// ReLU have smaller ones there, and the searches for steep slopes; then, where it is wanted, branch and bound. Every
/// bound is proved whenever `stop` ends the work; those that it cut short say so.
/// @param layers of the whole network, with their norms.
void find_bounds(const files::Network& network, const CertifyOptions& options, const Stop& stop,
                 WorkProgress& progress, const std::vector<CertifiedLayer>& layers,
                 std::vector<CertifiedBound>& bounds);

}  // namespace swarmcert::lipschitz
