/// @file Multi-step predictions as JSON, as text, as a figure and as arrays for NumPy.
#pragma once

#include <string>
#include <vector>

#include "analysis/report/report.h"
#include "analysis/residuals/prediction.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {

/// Returns {steps, step_s, starts, position_m, velocity_m_s, rotation_rad, rate_rad_s, held, flights[]}. Each quantity
/// is {h1, h10, h50, sum, by_step[]}: the mean over starts and flights of the error after 1, 10, 50 steps (null beyond
/// the horizon), and its sum over all steps. `held`: the same of a prediction that nothing changes. Null if no flight
/// could be predicted.
files::Json json_of(const std::vector<residuals::FlightPrediction>& flights);

/// Prints the JSON of json_of() as a table.
void print_prediction(const files::Json& prediction);

/// Adds the error against the horizon to the report. @param prediction of json_of()
void add_prediction(Report& report, const files::Json& prediction);

/// Writes FLIGHT.npy for each predicted log, FLIGHT being its file name without ending: float32, [starts x steps x 13],
/// the state predicted from each record: x y z vx vy vz qx qy qz qw wx wy wz. NaN where nothing is predicted.
/// @throws UsageError if two logs have the same name.
void write_predictions(const std::vector<residuals::FlightPrediction>& flights, const std::string& folder,
                       bool overwrite);

}  // namespace swarmcert::analysis
