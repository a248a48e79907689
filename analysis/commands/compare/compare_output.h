/// @file A comparison as JSON and as text.
#pragma once

#include "analysis/residuals/comparison.h"
#include "analysis/residuals/velocity_error.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {

files::Json json_of(const residuals::VelocityError& error);

/// Fields of the result of compare, in newton and metres; without its head.
void add_comparison(const residuals::Comparison& comparison, const residuals::Inputs& inputs,
                    files::Json& json);

/// Mean square of the vertical residual by composition, in gf^2: the unit in which the networks were published.
files::Json mean_squares_gf2(const residuals::Comparison& comparison);

/// Text for people, in residuals::force_unit().
/// @param own the same flights with this project's own cuts and filters; nullptr where they are those of `comparison`.
void print_comparison(const residuals::Comparison& comparison, const residuals::Inputs& inputs,
                      const residuals::Comparison* own);

}  // namespace swarmcert::analysis
