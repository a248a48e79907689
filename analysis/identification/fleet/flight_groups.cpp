#include "analysis/identification/fleet/flight_groups.h"

#include <algorithm>
#include <filesystem>
#include <map>

#include "analysis/identification/kind_fit.h"

namespace swarmcert::identification {

using residuals::Inputs;

Inputs of_one_vehicle(const Inputs& inputs, const std::string& kind, const std::string& vehicle) {
  Inputs alone = inputs;
  alone.found.flights.clear();
  for (const residuals::FlightFiles& flight : inputs.found.flights) {
    bool has_it = false;
    for (const auto& [name, path] : flight.logs) {
      has_it = has_it || name == vehicle;
      residuals::VehicleUse use = use_of(inputs, name);
      if (name == vehicle || use.kind != kind) continue;
      use.position_only = true;
      alone.fleet[name] = use;
    }
    if (has_it) alone.found.flights.push_back(flight);
  }
  return alone;
}

Inputs with_model_of_kind(const Inputs& inputs, const std::string& kind, const stability::Model& model) {
  Inputs changed = inputs;
  for (stability::Model& own : changed.models) {
    if (own.kind == kind) own = model;
  }
  return changed;
}

std::string folder_of(const residuals::FlightFiles& flight) {
  if (flight.logs.empty()) return "";
  return std::filesystem::path(flight.logs[0].second).parent_path().lexically_normal().string();
}

std::vector<FlightGroup> by_folder(const residuals::FoundFlights& found) {
  std::map<std::string, FlightGroup> groups;
  for (std::size_t i = 0; i < found.flights.size(); ++i) {
    const std::string folder = folder_of(found.flights[i]);
    groups[folder].name = folder;
    groups[folder].flights.push_back(static_cast<int>(i));
  }
  std::vector<FlightGroup> result;
  for (auto& [name, group] : groups) result.push_back(std::move(group));
  return result;
}

std::vector<FlightGroup> by_flight(const residuals::FoundFlights& found) {
  std::vector<FlightGroup> result;
  for (std::size_t i = 0; i < found.flights.size(); ++i)
    result.push_back({found.flights[i].name, {static_cast<int>(i)}});
  return result;
}

}  // namespace swarmcert::identification
