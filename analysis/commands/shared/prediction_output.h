/// @file Multi-step predictions: described, as text, as a figure and as arrays for NumPy.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "analysis/report/report.h"
#include "analysis/residuals/prediction.h"
#include "nn/base/record.h"

namespace swarmcert::analysis {

/// Multi-step predictions from all measured states.
struct Prediction {
  residuals::PredictionErrors errors,
      held;  ///< means over flights; `held`: of a prediction that nothing changes
  double step_s = 0;
  std::size_t starts = 0;
  std::vector<residuals::FlightPrediction> flights;

  std::size_t steps() const { return errors[0].mean.size(); }
};
/// Each quantity is the error after 1, 10, 50 steps (null beyond the horizon), and its sum over all steps.
void describe(files::Record& record, const Prediction& prediction);

/// Returns the means over flights; nothing if no flight could be predicted.
std::optional<Prediction> prediction_of(std::vector<residuals::FlightPrediction> flights);

void print_prediction(const std::optional<Prediction>& prediction);

/// The prediction of a model that a figure calls `name`.
struct NamedPrediction {
  const char* name;
  const std::optional<Prediction>& prediction;
};
/// Adds a figure of the errors of position, velocity, rotation and body rate against the horizon, one curve per model.
/// Nothing is added if the first predicted nothing.
void add_prediction(Report& report, const std::vector<NamedPrediction>& named);

/// Writes FLIGHT.npy for each predicted log, FLIGHT being its file name without ending: float32, [starts x steps x 13],
/// the state predicted from each record: x y z vx vy vz qx qy qz qw wx wy wz. NaN where nothing is predicted.
/// @throws UsageError if two logs have the same name.
void write_predictions(const std::vector<residuals::FlightPrediction>& flights, const std::string& folder,
                       bool overwrite);

}  // namespace swarmcert::analysis
