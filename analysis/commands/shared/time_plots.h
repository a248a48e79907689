/// @file Residuals over time with zoom, and definitions shared by plots of residuals.
#pragma once

#include <string>

#include "analysis/report/report.h"
#include "analysis/residuals/comparison.h"

namespace swarmcert::analysis {

/// Units of the first kPlottedVariables of residuals::variable_name(), which are scalars; the later variables are
/// neighbour positions.
inline constexpr int kPlottedVariables = 6;
inline constexpr const char* kVariableUnits[kPlottedVariables] = {"[m]", "[m/s]", "[-]",
                                                                  "[V]", "[s]",   "[degrees]"};

/// Returns the name that time series and worst moments use for a log.
std::string series_name(const residuals::TrackErrors& track);

/// Adds residuals over time with zoom: vehicles with the worst moments first, then the others, as far as they fit on
/// a page.
/// @param before the same logs under another model, whose vertical residual is shown alongside and whose worst
///     moments are marked; or null.
/// @param unit unit of the forces shown.
/// @param per_newton factor from newton to that unit.
void add_time_series(Report& report, const residuals::Comparison& comparison,
                     const residuals::Comparison* before, const std::string& unit, double per_newton);

}  // namespace swarmcert::analysis
