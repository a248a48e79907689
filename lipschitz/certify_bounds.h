/// @file The bounds of a certification: what is done for each claim, in which order, within which time.
#pragma once

#include "lipschitz/base/stop.h"
#include "lipschitz/base/work_progress.h"
#include "lipschitz/certify.h"

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

/// Replaces `bound` by a smaller one for inputs in `box`, by the product of norms and by the matrix inequality, where
/// the slopes that the activations have there give one. Whether the inequality was proved, smaller or not.
/// @param box of the moving input, as it leaves the clamp. @param method kProduct: by the product alone.
/// @param options `known` is taken from the bound.
bool bound_by_slopes_on_box(const files::Network& network, const Box& box,
                            const std::vector<CertifiedLayer>& layers, UpperMethod method, SdpOptions options,
                            CertifiedBound& bound);

}  // namespace swarmcert::lipschitz
