/// @file Residuals over time with zoom, and what plots of residuals have in common.
#pragma once

#include <string>

#include "analysis/report/report.h"
#include "analysis/residuals/comparison.h"

namespace swarmcert::analysis {

/// Units of the first kPlottedVariables of residuals::variable_name(), which are numbers; those after them are places
/// of neighbours.
inline constexpr int kPlottedVariables = 6;
inline constexpr const char* kVariableUnits[kPlottedVariables] = {"[m]", "[m/s]", "[-]",
                                                                  "[V]", "[s]",   "[degrees]"};

/// The name by which time series and worst moments call a log.
std::string series_name(const residuals::TrackErrors& track);

/// Residuals over time with zoom: vehicles with the worst moments first, then the others, as far as a page can hold
/// them.
/// @param before the same logs under another model, whose vertical residual is shown beside and whose worst moments are
///               marked; or null.
/// @param unit, per_newton of the forces shown
void add_time_series(Report& report, const residuals::Comparison& comparison,
                     const residuals::Comparison* before, const std::string& unit, double per_newton);

}  // namespace swarmcert::analysis
