/// @file What the remainder depends on, in the result, the text and the report of `diagnose`.
#pragma once

#include <string>

#include "analysis/identification/diagnose.h"
#include "analysis/report/report.h"
#include "analysis/residuals/force_unit.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {

/// `remainder[]` of one kind of vehicle, best first.
files::Json remainder_json(const identification::Diagnosis& diagnosis);

/// The first few of them, a line each.
void print_remainder(const identification::Diagnosis& diagnosis);

/// A table of them, with a figure for the first few. @param number of the kind, for the figures' names.
void add_remainder(Report& report, const identification::Diagnosis& diagnosis, std::size_t number,
                   const residuals::ForceUnit& unit);

}  // namespace swarmcert::analysis
