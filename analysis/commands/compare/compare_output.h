/// @file The result of a comparison as text.
#pragma once

#include "analysis/residuals/comparison.h"
#include "analysis/residuals/force_unit.h"

namespace swarmcert::analysis {

/// Prints the comparison as text.
/// @param own the same flights with this project's own cuts and filters; nullptr if `comparison` uses them already.
void print_comparison(const residuals::Comparison& comparison, const residuals::Inputs& inputs,
                      const residuals::Comparison* own, const residuals::ForceUnit& unit);

}  // namespace swarmcert::analysis
