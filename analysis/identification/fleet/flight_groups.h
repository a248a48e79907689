/// @file Groups flights by day, and selects the flights of one vehicle.
#pragma once

#include <string>
#include <vector>

#include "analysis/residuals/inputs.h"
#include "stability/effects/effect.h"

namespace swarmcert::identification {

/// Returns `inputs` with only the flights of `vehicle`, in which all other vehicles of `kind` serve only as neighbours.
residuals::Inputs of_one_vehicle(const residuals::Inputs& inputs, const std::string& kind,
                                 const std::string& vehicle);

/// Returns `inputs` with `model` as the model of `kind`.
residuals::Inputs with_model_of_kind(const residuals::Inputs& inputs, const std::string& kind,
                                     const stability::Model& model);

/// A group of flights, as indices into found.flights.
struct FlightGroup {
  std::string name;
  std::vector<int> flights;
};

/// Returns the folder of a flight's first log, which identifies its day.
std::string folder_of(const residuals::FlightFiles& flight);

/// Returns one group per folder, ordered by name.
std::vector<FlightGroup> by_folder(const residuals::FoundFlights& found);

/// Returns one group per flight.
std::vector<FlightGroup> by_flight(const residuals::FoundFlights& found);

}  // namespace swarmcert::identification
