/// @file The table over flights and days of `diagnose --each` as result, text and plots.
#pragma once

#include <vector>

#include "analysis/identification/fleet/each.h"
#include "analysis/report/report.h"
#include "nn/base/record.h"

namespace swarmcert::analysis {

/// Describes `each`, `each_days`, `each_drifts`. A parameter that a flight does not reveal is null.
void describe_each(files::Record& record, const std::vector<identification::Each>& kinds);

/// Prints text lines: flights, then days with more than one flight, then drifts.
void print_each(const identification::Each& each);

/// Adds a table, and a plot of every parameter over the flights.
/// @param number number of the kind, used in the names of figures.
void add_each(Report& report, const identification::Each& each, std::size_t number);

}  // namespace swarmcert::analysis
