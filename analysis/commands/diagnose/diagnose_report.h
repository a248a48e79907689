/// @file The HTML report of a diagnosis.
#pragma once

#include <string>
#include <vector>

#include "analysis/identification/fleet/difference.h"
#include "analysis/identification/fleet/each.h"
#include "analysis/report/report.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {

/// Writes FOLDER/report.html with the ranking of every kind of vehicle as a plot and the JSON `result`; returns its
/// path.
/// @param differences that the diagnoses are, in their order; empty where they are of all flights
/// @param each the tables over flights, by kind; may be empty
/// @throws as Report::write().
std::string write_diagnose_report(const std::vector<identification::Diagnosis>& diagnoses,
                                  const std::vector<identification::Difference>& differences,
                                  const std::vector<identification::Each>& each, const files::Json& result,
                                  const std::string& folder, bool overwrite);

/// What is left after the effects that were found, what was not counted and why, and the detection limits.
void add_left(Report& report, const identification::Diagnosis& diagnosis);

}  // namespace swarmcert::analysis
