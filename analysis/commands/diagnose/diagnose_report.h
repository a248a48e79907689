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

/// Writes FOLDER/report.html with the ranking of every kind of vehicle as a plot and the JSON `result`. Returns its
/// path.
/// @param differences the differences from which the diagnoses come, in the same order; empty for diagnoses of all
///     flights
/// @param unit unit of the forces on the page
/// @param each the tables over flights, by kind; may be empty
/// @param notes one sentence per mislabelled log and per clock offset
/// @throws as Report::write().
std::string write_diagnose_report(const std::vector<identification::Diagnosis>& diagnoses,
                                  const std::vector<identification::Difference>& differences,
                                  const std::vector<identification::Each>& each,
                                  const std::vector<std::string>& notes, const residuals::ForceUnit& unit,
                                  const files::Json& result, const std::string& folder, bool overwrite);

/// Adds the ranking as a table and as bars.
/// @param name name of the figure
void add_ranking(Report& report, const identification::Diagnosis& diagnosis, const std::string& name,
                 const residuals::ForceUnit& unit);

/// Adds what remains after the effects found, what was not counted and why, and the detection limits.
void add_left(Report& report, const identification::Diagnosis& diagnosis, const residuals::ForceUnit& unit);

/// Adds the detection limits alone.
void add_detectable(Report& report, const identification::Diagnosis& diagnosis);

}  // namespace swarmcert::analysis
