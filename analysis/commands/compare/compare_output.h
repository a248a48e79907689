/// @file Results of a comparison as JSON and as text.
#pragma once

#include "analysis/residuals/comparison.h"
#include "analysis/residuals/velocity_error.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {

files::Json json_of(const residuals::VelocityError& error);

/// Adds the fields of the result of compare, in newton and metres; the head is not included.
void add_comparison(const residuals::Comparison& comparison, const residuals::Inputs& inputs,
                    files::Json& json);

/// Returns the mean square of the vertical residual by composition, in gf^2, the unit used by the published networks.
files::Json mean_squares_gf2(const residuals::Comparison& comparison);

/// Prints the comparison as text in residuals::force_unit().
/// @param own the same flights with this project's own cuts and filters; nullptr if `comparison` uses them already.
void print_comparison(const residuals::Comparison& comparison, const residuals::Inputs& inputs,
                      const residuals::Comparison* own);

}  // namespace swarmcert::analysis
