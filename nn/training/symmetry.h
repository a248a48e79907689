/// @file Data augmentation: forces are equivariant under rotation about the vertical, so rotated samples are valid.
#pragma once

#include "nn/base/random.h"
#include "nn/training/deep_set_loss.h"

namespace swarmcert::training {

/// Replaces the inputs of `turned` by those of `source`, with each sample rotated about the vertical by its own angle,
/// uniform in [0, 2 pi), and mirrored in a vertical plane with probability 1/2. All inputs of a sample undergo the same
/// transformation, which preserves their relative geometry. A network fitted to rotated samples does not adapt to the
/// directions that happened to be recorded. The targets are transformed accordingly: a vertical force is unchanged, a
/// force vector is rotated and mirrored like the inputs, and a torque is rotated and, being an axial vector, changes
/// the signs of the other two components when it is mirrored.
///
/// @param layout names the horizontal vectors among each part's inputs; parts without any are unchanged.
/// @param turned a copy of `source` except for its x and, with three outputs, its targets.
void turn_about_vertical(const Layout& layout, const Dataset& source, files::Random& random, Dataset& turned);

}  // namespace swarmcert::training
