/// @file An error budget as JSON, as text and as model files.
#pragma once

#include <string>

#include "analysis/identification/budget.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {

/// Returns `rows[]: {name, rmse_z: {composition: newton}}`, `drop` of the last model row relative to the first, and
/// its ratio to the network's row.
files::Json json_of(const identification::Budget& budget);

void print(const identification::Budget& budget);

/// Writes `FOLDER/<vehicle>.toml` for each vehicle whose force is judged, and a flights.toml that names them.
/// Vehicles for which `fleet` uses only the position remain position-only in that file, with the model of their kind:
/// their sensors would teach `train` false forces.
void write_fitted(const identification::Budget& budget, const residuals::Fleet& fleet,
                  const std::string& folder, bool overwrite);

}  // namespace swarmcert::analysis
