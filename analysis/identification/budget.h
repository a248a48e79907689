/// @file The error budget: how the error of flights falls from the nominal model to one with all known effects.
///
/// Rows add up: nominal, motor lag, a constant force per vehicle, ground, downwash, the rest. Coefficients and shapes
/// are fitted jointly, on flights that the rows are not judged on: once for the rows up to downwash, once with the
/// rest. Fitted one after the other, an offset would take what belongs to the downwash.
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
  std::map<std::string, stability::Model> fitted;  ///< with everything, by vehicle
  std::size_t fit_flights = 0, test_flights = 0;
};

/// @param fit, test Inputs with the same models. Kinds of published vehicles are tried with their model's mass and with
///                  the published one (published_vehicle()); the one that is better on `fit` is nominal. `test` is
///                  judged and chooses nothing.
/// @param network   a learned force for one more row, with the authors' masses, thrust lag and unfiltered acceleration,
///                  on the same records; empty: none.
Budget error_budget(const residuals::Inputs& fit, const residuals::Inputs& test, const std::string& network,
                    int jobs, const residuals::Progress& progress);

}  // namespace swarmcert::identification
