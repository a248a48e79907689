/// @file The table over flights and days of `diagnose --each` as JSON, text and plots.
#pragma once

#include <vector>

#include "analysis/identification/fleet/each.h"
#include "analysis/report/report.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {

/// Adds `each[]`, `each_days[]`, `each_drifts[]`. A parameter that a flight does not reveal is null.
void add_each(const std::vector<identification::Each>& kinds, files::Json& result);

/// Prints text lines: flights, then days with more than one flight, then drifts.
void print_each(const identification::Each& each);

/// Adds a table, and a plot of every parameter over the flights.
/// @param number number of the kind, used in the names of figures.
void add_each(Report& report, const identification::Each& each, std::size_t number);

}  // namespace swarmcert::analysis
