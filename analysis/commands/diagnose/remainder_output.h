/// @file The variables on which the remainder depends, in the result, the text and the report of `diagnose`.
#pragma once

#include <string>
#include <vector>

#include "analysis/identification/diagnose.h"
#include "analysis/report/report.h"
#include "analysis/residuals/force_unit.h"
#include "nn/base/record.h"

namespace swarmcert::analysis {

/// Describes `remainder`, for each kind of vehicle best first.
void describe_remainder(files::Record& record, const std::vector<identification::Diagnosis>& diagnoses);

/// Prints the first few entries, one line each.
void print_remainder(const identification::Diagnosis& diagnosis, const residuals::ForceUnit& unit);

/// Adds a table of the entries, with a figure for the first few.
/// @param number number of the kind, used in the names of figures.
void add_remainder(Report& report, const identification::Diagnosis& diagnosis, std::size_t number,
                   const residuals::ForceUnit& unit);

}  // namespace swarmcert::analysis
