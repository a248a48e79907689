/// @file Last step of training: projection to weights that satisfy gamma in exact arithmetic.
#pragma once

#include "nn/training/layout.h"
#include "nn/weights/network.h"

namespace swarmcert::learning {

/// Scales every layer that is not proved to satisfy `gamma` (lipschitz::respects_gamma()) down, in float32, until it
/// is. What is then in `theta` is what will be stored, bit for bit. Power iteration during training stops just below
/// the norm, and rounding to float32 may raise it again: the published networks exceed their gamma in two layers.
/// @throws std::runtime_error if a layer cannot be proved after all, which needs a gamma at the limit of float32.
void project(const training::Layout& layout, const files::GammaStatement& gamma, training::Vector& theta);

}  // namespace swarmcert::learning
