/// @file Which files are flights, and what is known of the vehicles that flew them.
#pragma once

#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace swarmcert::residuals {

/// All vehicles of one flight.
struct FlightFiles {
  std::string name;      ///< "21_swap_ss/00": folder, prefix and run
  std::string scenario;  ///< "21_swap_ss": folder and prefix
  int run = 0;
  std::vector<std::pair<std::string, std::string>> logs;  ///< vehicle ("cf50") and path, in order of vehicles
  std::string why;                                        ///< these files are one flight
  /// By path of a log: by how much its clock is ahead of the first log's, where that was found from the flight itself.
  std::map<std::string, double> clock_offsets_s;
  std::set<std::string> position_only;  ///< paths of logs of which flights.toml takes the position only
};

/// `[log."GLOB"]` of flights.toml: what is known of single logs. Empty texts and zeros say nothing.
struct LogRule {
  std::string pattern;
  std::string vehicle, flight;  ///< "{folder}" and "{file}" stand for the log's folder and name
  std::string model, gains;     ///< paths
  double mass_kg = 0;
  enum class Use { kUnsaid, kAll, kPosition, kNone } use = Use::kUnsaid;
};
using LogRules = std::vector<LogRule>;

/// What `rules` say of a log, taken together: a pattern without wildcards before one with, a longer before a shorter.
/// A pattern is matched against the end of the path, with or without extension: as many folders as it names:
/// "alpha/*/*" matches every log two folders below alpha.
LogRule rule_for(const LogRules& rules, const std::string& path);

struct FoundFlights {
  std::vector<FlightFiles> flights;   ///< in order of their names and runs
  std::vector<std::string> skipped;   ///< files in the folders that are no logs
  std::vector<std::string> left_out;  ///< logs that flights.toml leaves out
};

/// Patterns of `rules` that match none of the logs: misspelt ones, or those of other flights.
std::vector<std::string> patterns_without_log(const LogRules& rules, const FoundFlights& found);

/// Files and folders, searched recursively. A log may have any name; it is recognised by its content. One log is one
/// flight of one vehicle, unless
/// - files are named `[<prefix>_]cf<id>_<run>`, with or without ".csv": folder, prefix and run name the flight, and
///   where a vehicle has a binary log and a CSV, the binary log is taken;
/// - `rules` give them one flight;
/// - logs of one folder have absolute times (of their clock, or of a satellite receiver) that overlap by more than
/// half. A vehicle that nothing names is called as in `<vehicle>_log07`, else as its folder.
/// @throws files::InputError if a path does not exist, a file that was named is no log, or nothing is left.
FoundFlights find_flights(const std::vector<std::string>& paths, const LogRules& rules = {});

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

/// Tables [log."NAME"] of the same file, where NAME may hold wildcards: vehicle, flight, model, gains, mass_kg and use
/// ("all", "position" or "none"); paths are relative to the file's folder.
/// @throws files::InputError with line and key.
LogRules read_log_rules(const std::string& path);

}  // namespace swarmcert::residuals
