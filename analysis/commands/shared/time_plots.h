/// @file What vehicles flew, over time and in space, and definitions shared by plots of residuals.
#pragma once

#include <vector>

#include "analysis/report/report.h"
#include "analysis/residuals/comparison.h"
#include "analysis/residuals/flown_signals.h"
#include "analysis/residuals/force_unit.h"

namespace swarmcert::analysis {

/// Units of the first kPlottedVariables of residuals::variable_name(), which are scalars; the later variables are
/// neighbour positions.
inline constexpr int kPlottedVariables = 7;
inline constexpr const char* kVariableUnits[kPlottedVariables] = {"[m]", "[m/s]",     "[-]",  "[V]",
                                                                  "[s]", "[degrees]", "[m/s]"};

/// Adds a table of the worst moments, to which the figures of add_flown() can jump.
void add_moments(Report& report, const residuals::Comparison& comparison, const residuals::ForceUnit& unit);

/// Adds signals over time and the flights in space, and says which part of the logs they hold.
/// @param flights empty: says that the page holds no signals
/// @param comparison of the given model: its worst moments are marked, and the axis that fails is shown first
void add_flown(Report& report, const std::vector<residuals::FlownFlight>& flights,
               const residuals::Comparison& comparison, const residuals::ForceUnit& unit);

}  // namespace swarmcert::analysis
