/// @file Days of flight, and the flights of one vehicle.
#pragma once

#include <string>
#include <vector>

#include "analysis/residuals/inputs.h"
#include "stability/effects/effect.h"

namespace swarmcert::identification {

/// `inputs` in which every vehicle of `kind` other than `vehicle` is a neighbour and nothing else, with the flights of
/// `vehicle` alone.
residuals::Inputs of_one_vehicle(const residuals::Inputs& inputs, const std::string& kind,
                                 const std::string& vehicle);

/// `inputs` whose model of `kind` is `model`.
residuals::Inputs with_model_of_kind(const residuals::Inputs& inputs, const std::string& kind,
                                     const stability::Model& model);

/// Flights that belong together, as indices into found.flights.
struct FlightGroup {
  std::string name;
  std::vector<int> flights;
};

/// The folder of a flight's first log, which stands for its day.
std::string folder_of(const residuals::FlightFiles& flight);

/// One group per folder, in the order of their names.
std::vector<FlightGroup> by_folder(const residuals::FoundFlights& found);

/// One group per flight.
std::vector<FlightGroup> by_flight(const residuals::FoundFlights& found);

}  // namespace swarmcert::identification
