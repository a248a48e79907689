/// @file Augmentation: forces are equivariant under rotation about the vertical, so rotated samples are samples.
#pragma once

#include "nn/base/random.h"
#include "nn/training/deep_set_loss.h"

namespace swarmcert::training {

/// Replaces the inputs of `turned` by those of `source`, each sample turned about the vertical by an angle of its own,
/// uniform in [0, 2 pi), and mirrored in a vertical plane in half of the cases: the same for all inputs of a sample,
/// since what they are to one another stays. A network which is fitted to turned samples spends nothing on directions
/// in which the recorded ones happened to lie. The targets follow: a vertical force stays, a force turns and is
/// mirrored as the inputs are, a torque turns and, being an axial vector, changes the other two signs where it is
/// mirrored.
///
/// @param layout names the horizontal vectors of each part's inputs; parts that name none are left as they are.
/// @param turned a copy of `source` but for its x and, with three outputs, its targets.
void turn_about_vertical(const Layout& layout, const Dataset& source, files::Random& random, Dataset& turned);

}  // namespace swarmcert::training
