/// @file Where a model fails, as a plot of characters for the terminal.
#pragma once

#include <string>

#include "analysis/residuals/failing_place.h"

namespace swarmcert::analysis {

/// Returns the mean residual along the axis that fails most: a bar for each region of the variable of `place`, or for
/// places over the ground a map with a number in each square. Empty if the model does not fail in a region.
std::string character_plot(const residuals::Comparison& comparison, const residuals::FailingPlace& place,
                           const residuals::ForceUnit& unit);

}  // namespace swarmcert::analysis
