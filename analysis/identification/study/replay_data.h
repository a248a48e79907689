/// @file Flights in space, with the residual force on every vehicle before and after effects were added.
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
  /// Time of the flight in s; position in W in m; residual force in W in newton under the given model; the same under
  /// the fitted model. Forces are NaN where a record was cut.
  std::vector<std::array<float, 10>> rows;
};

struct ReplayFlight {
  std::string name;
  std::vector<ReplayVehicle> vehicles;
};

/// The flights of `worst` in its order, then others, as many as a page can hold, at no more than ten rows per second.
/// @param before, after models of the same kind of vehicle; vehicles of other kinds have positions only.
std::vector<ReplayFlight> replay_data(const residuals::Inputs& inputs, const stability::Model& before,
                                      const stability::Model& after,
                                      const std::vector<residuals::Moment>& worst);

}  // namespace swarmcert::identification
