/// @file Flights in space, with the residual force on each vehicle before and after effects were added.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "analysis/residuals/comparison.h"
#include "analysis/residuals/inputs.h"
#include "stability/model.h"

namespace swarmcert::identification {

struct ReplayVehicle {
  std::string name;
  /// Time in flight, s; position in W, m; residual force in W in newton with the given model; the same with the fitted
  /// model. Forces are NaN at cut records.
  std::vector<std::array<float, 10>> rows;
};

struct ReplayFlight {
  std::string name;
  std::vector<ReplayVehicle> vehicles;
};

/// Returns the flights of `worst` in this order, then others, as many as fit on a page, at most ten rows per second.
/// @param before, after models of the same kind of vehicle; vehicles of other kinds have only positions
std::vector<ReplayFlight> replay_data(const residuals::Inputs& inputs, const stability::Model& before,
                                      const stability::Model& after,
                                      const std::vector<residuals::Moment>& worst);

}  // namespace swarmcert::identification
