/// @file The table over flights and days of `diagnose --each` as JSON, text and plots.
#pragma once

#include <vector>

#include "analysis/identification/fleet/each.h"
#include "analysis/report/report.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {

/// `each[]`, `each_days[]`, `each_drifts[]`. A number that a flight does not show is null.
void add_each(const std::vector<identification::Each>& kinds, files::Json& result);

/// Lines for people: flights, then days of more than one flight, then drifts.
void print_each(const identification::Each& each);

/// A table, and a plot of every number over the flights. @param number of the kind, for the figures' names.
void add_each(Report& report, const identification::Each& each, std::size_t number);

}  // namespace swarmcert::analysis
