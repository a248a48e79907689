/// @file The variables on which the remainder depends, in the result, the text and the report of `diagnose`.
#pragma once

#include <string>

#include "analysis/identification/diagnose.h"
#include "analysis/report/report.h"
#include "analysis/residuals/force_unit.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {

/// Returns `remainder[]` for one kind of vehicle, best first.
files::Json remainder_json(const identification::Diagnosis& diagnosis);

/// Prints the first few entries, one line each.
void print_remainder(const identification::Diagnosis& diagnosis);

/// Adds a table of the entries, with a figure for the first few.
/// @param number number of the kind, used in the names of figures.
void add_remainder(Report& report, const identification::Diagnosis& diagnosis, std::size_t number,
                   const residuals::ForceUnit& unit);

}  // namespace swarmcert::analysis
