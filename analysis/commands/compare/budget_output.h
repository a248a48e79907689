/// @file An error budget: described, as text and as model files.
#pragma once

#include <string>

#include "analysis/identification/budget.h"
#include "analysis/residuals/force_unit.h"
#include "nn/base/record.h"

namespace swarmcert::analysis {

/// Describes the rows, the drop of the last model row relative to the first, and its ratio to the network's row.
void describe_budget(files::Record& record, const identification::Budget& budget);

void print(const identification::Budget& budget, const residuals::ForceUnit& unit);

/// Writes `FOLDER/<vehicle>.toml` for each vehicle whose force is judged, and a flights.toml that names them.
/// Vehicles for which `fleet` uses only the position remain position-only in that file, with the model of their kind:
/// their sensors would teach `train` false forces.
void write_fitted(const identification::Budget& budget, const residuals::Fleet& fleet,
                  const std::string& folder, bool overwrite);

}  // namespace swarmcert::analysis
