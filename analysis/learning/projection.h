/// @file Last step of training: projection to weights that satisfy gamma in exact arithmetic.
#pragma once

#include "nn/training/layout.h"
#include "nn/weights/network.h"

namespace swarmcert::learning {

/// Scales down, in float32, every layer that is not proved to satisfy `gamma` (lipschitz::respects_gamma()), until it
/// is. `theta` is then stored bit for bit. This is necessary because power iteration during training stops just below
/// the norm, and rounding to float32 may raise the norm again: the published networks exceed their gamma in two layers.
/// @throws std::runtime_error if a layer still cannot be proved, which requires a gamma at the limit of float32.
void project(const training::Layout& layout, const files::GammaStatement& gamma, training::Vector& theta);

}  // namespace swarmcert::learning
