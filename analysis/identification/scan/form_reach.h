/// @file What a form says beyond the values to which it was fitted.
#pragma once

#include <vector>

#include "analysis/identification/scan/forms.h"

namespace swarmcert::identification {

/// Returns whether a function of the form becomes larger, far beyond the range of one of its inputs, than anywhere
/// within the ranges: a slope or a power over a place, say. A Gaussian, a step and a sinusoid do not.
/// @param ranges of the form's inputs
bool grows_beyond(const Form& form, const std::vector<double>& theta, const std::vector<FormRange>& ranges,
                  std::size_t input);

}  // namespace swarmcert::identification
