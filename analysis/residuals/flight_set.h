/// @file Which files are flights, and what is known of the vehicles that flew them.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

namespace swarmcert::residuals {

/// All vehicles of one run.
struct FlightFiles {
  std::string name;      ///< "21_swap_ss/00": folder, prefix and run
  std::string scenario;  ///< "21_swap_ss": folder and prefix
  int run = 0;
  std::vector<std::pair<std::string, std::string>> logs;  ///< vehicle ("cf50") and path, in order of vehicles
};

struct FoundFlights {
  std::vector<FlightFiles> flights;  ///< in order of their names and runs
  std::vector<std::string> skipped;  ///< files in the folders that are no logs
};

/// Files and folders, searched recursively. A log is named `[<prefix>_]cf<id>_<run>`, with or without ".csv"; folder,
/// prefix and run name the flight. Where a vehicle has a binary log and a CSV, the binary log is taken.
/// @throws files::InputError if a path does not exist, a file that was named is no log, or nothing is left.
FoundFlights find_flights(const std::vector<std::string>& paths);

/// What flights.toml says of a vehicle.
struct VehicleUse {
  std::string kind;
  std::string model;           ///< path of its model file
  bool position_only = false;  ///< only a neighbour: its sensors are not good enough for a force
};

/// Vehicles by name.
using Fleet = std::map<std::string, VehicleUse>;

/// `[vehicle.cf50] model = "...", use = "all" | "position"`; models are relative to the file's folder.
/// @throws files::InputError with line and key; also where a model cannot be read.
Fleet read_fleet(const std::string& path);

}  // namespace swarmcert::residuals
