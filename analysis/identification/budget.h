/// @file The error budget: how the error in flight falls from the nominal model to one with all known effects.
///
/// The rows are cumulative: nominal, motor lag, a constant force per vehicle, ground effect, downwash, the rest.
/// Coefficients and shapes are fitted jointly, on flights that are not used to evaluate the rows: once for the rows up
/// to downwash and once with the rest. Fitted one after the other, an offset would absorb part of the downwash.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "analysis/residuals/comparison.h"
#include "analysis/residuals/inputs.h"

namespace swarmcert::identification {

struct BudgetRow {
  std::string name;  ///< "nominal", "lag", "offset", "ground", "jet", "rest"
  std::map<std::string, residuals::ErrorStatistics> of;  ///< by composition, "kind <name>", and "all"
  std::map<std::string, stability::Model> models;        ///< by vehicle; empty for "nominal" and "network"
};

struct Budget {
  std::vector<BudgetRow> rows;                     ///< the last may be "network"
  std::map<std::string, double> masses_kg;         ///< of the nominal models, by kind
  std::map<std::string, stability::Model> fitted;  ///< with all effects, by vehicle
  std::size_t fit_flights = 0, test_flights = 0;
};

/// Computes the budget.
/// @param fit, test Inputs with the same models. For published kinds, both the mass of the model and the published mass
///   (published_vehicle()) are tried; the one with the smaller error on `fit` is nominal. `test` is only evaluated and
///   never used for a choice.
/// @param network   a learned force for one more row, with the authors' masses, thrust lag and unfiltered acceleration,
///   on the same records; empty: none
Budget error_budget(const residuals::Inputs& fit, const residuals::Inputs& test, const std::string& network,
                    int jobs, const residuals::Progress& progress);

}  // namespace swarmcert::identification
