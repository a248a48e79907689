/// @file Folds the normalisation of inputs and output that a file states into the first and the last layer.
#pragma once

#include <vector>

#include "nn/weights/enclosed.h"
#include "nn/weights/weights.h"

namespace swarmcert::files {

/// Returns x -> range f((x - m) ./ r) + mean, with m and r the first numbers of `means` and `ranges`, one per input,
/// and `mean` and `range` their last one, for all outputs. Exact, or with the rounding that Layer states.
/// @throws InputError if a range is 0 or the result is not finite.
/// @throws std::invalid_argument unless there are weights.inputs() + 1 of each.
Weights normalized(Weights weights, const std::vector<double>& means, const std::vector<double>& ranges);

/// Returns x -> f((x - m) ./ r) with one mean and one range per input. Exact, or with the rounding that Layer states.
/// @throws InputError as normalized(), and if the first layer was rounded before.
Weights with_normalized_inputs(Weights weights, const std::vector<Enclosed>& means,
                               const std::vector<Enclosed>& ranges);

}  // namespace swarmcert::files
