/// @file The result of `compare`, described.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "analysis/commands/shared/collection_table.h"
#include "analysis/commands/shared/prediction_output.h"
#include "analysis/identification/budget.h"
#include "analysis/residuals/comparison.h"
#include "analysis/residuals/flight_errors.h"
#include "analysis/residuals/force_unit.h"
#include "analysis/tracking/kept_promise.h"
#include "nn/base/record.h"

namespace swarmcert::analysis {

/// Errors of single flights, from which bound --coverage computes its promise.
struct ErrorsOfFlights {
  std::map<std::string, residuals::FlightError> by_log;
  std::optional<residuals::VelocityError> velocity;  ///< quantiles over all windows
};

/// Logs that --inject wrote.
struct InjectedLogs {
  std::vector<std::string> logs, unchanged;
};

/// How often a promise held.
struct JudgedPromise {
  std::string file;
  Promise promise;
  KeptPromise kept;
};

struct CompareResult {
  residuals::Comparison comparison;
  residuals::Inputs inputs;
  residuals::ForceUnit unit;  ///< of words; numbers are in newton
  std::optional<ErrorsOfFlights> errors;
  std::optional<residuals::Comparison> own;  ///< with this tool's filter instead of the published one
  std::optional<identification::Budget> budget;
  std::optional<InjectedLogs> injected;
  std::optional<JudgedPromise> promise;
  std::optional<std::optional<Prediction>> prediction;  ///< asked for; nothing could be predicted
};
void describe(files::Record& record, const CompareResult& result);

/// The outcome for every log: axes with records that were compared.
std::vector<LogOutcome> outcomes_of(const residuals::Comparison& comparison, const residuals::Inputs& inputs);

/// The number of logs with a torque residual; if there are none, the reason.
struct TorqueSummary {
  std::size_t tracks = 0;
  std::string refused;
};
TorqueSummary torque_summary(const residuals::Comparison& comparison);

}  // namespace swarmcert::analysis
