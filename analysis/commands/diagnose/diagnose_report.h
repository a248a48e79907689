/// @file The HTML report of a diagnosis.
#pragma once

#include <string>
#include <vector>

#include "analysis/identification/fleet/difference.h"
#include "analysis/identification/fleet/each.h"
#include "analysis/report/report.h"
#include "analysis/residuals/force_unit.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {

/// Writes FOLDER/report.html with the ranking of every kind of vehicle as a plot and the JSON `result`; returns its
/// path.
/// @param differences that the diagnoses are, in their order; empty where they are of all flights
/// @param unit of the forces on the page
/// @param each the tables over flights, by kind; may be empty
/// @param notes on clocks and labels, one sentence each
/// @throws as Report::write().
std::string write_diagnose_report(const std::vector<identification::Diagnosis>& diagnoses,
                                  const std::vector<identification::Difference>& differences,
                                  const std::vector<identification::Each>& each,
                                  const std::vector<std::string>& notes, const residuals::ForceUnit& unit,
                                  const files::Json& result, const std::string& folder, bool overwrite);

/// The ranking as a table and as bars. @param name of the figure
void add_ranking(Report& report, const identification::Diagnosis& diagnosis, const std::string& name,
                 const residuals::ForceUnit& unit);

/// What is left after the effects that were found, what was not counted and why, and the detection limits.
void add_left(Report& report, const identification::Diagnosis& diagnosis, const residuals::ForceUnit& unit);

}  // namespace swarmcert::analysis
