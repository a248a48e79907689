/// @file Groups files into flights and reads what is known about the vehicles.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "nn/base/interval.h"

namespace swarmcert::files {
class Keys;
}

namespace swarmcert::residuals {

/// The logs of all vehicles of one flight.
struct FlightFiles {
  std::string name;      ///< "21_swap_ss/00": folder, prefix and run
  std::string scenario;  ///< "21_swap_ss": folder and prefix
  int run = 0;
  /// Vehicle ("cf50") and path, or FILE#VEHICLE, in order of vehicles.
  std::vector<std::pair<std::string, std::string>> logs;
  std::string why;  ///< why these files form one flight
  /// By path of a log: how far its clock is ahead of the first log's clock, if found from the flight itself.
  std::map<std::string, double> clock_offsets_s;
  std::set<std::string> position_only;  ///< paths of logs that flights.toml marks as position only
  std::optional<Interval>
      part_s;  ///< only this part of the flight, on the clock of its first log; empty: all of it
};

/// A `[log."GLOB"]` table of flights.toml with properties of single logs. Empty texts and zeros mean "not given".
struct LogRule {
  std::string pattern;
  std::string vehicle, flight;  ///< "{folder}" and "{file}" stand for the log's folder and name
  std::string model, gains;     ///< paths
  double mass_kg = 0;
  enum class Use { kUnsaid, kAll, kPosition, kNone } use = Use::kUnsaid;
};
using LogRules = std::vector<LogRule>;

/// Returns the combined rules for a log: patterns without wildcards take precedence over those with wildcards, longer
/// over shorter. A pattern is matched against as many trailing path components as it has, with or without the
/// extension: "alpha/*/*" matches each log two folders below alpha.
LogRule rule_for(const LogRules& rules, const std::string& path);

struct FoundFlights {
  std::vector<FlightFiles> flights;   ///< sorted by name and run
  std::vector<std::string> skipped;   ///< files in the folders that are not logs
  std::vector<std::string> left_out;  ///< logs excluded by flights.toml
  std::vector<std::pair<std::string, std::string>>
      copies;  ///< files of leave_out_copies(), and of what each is one
};

/// Returns the patterns of `rules` that match none of the logs: they are misspelt or belong to other flights.
std::vector<std::string> patterns_without_log(const LogRules& rules, const FoundFlights& found);

/// Finds flights in files and folders, searching folders recursively. A log may have any name; it is recognised by its
/// content. Each log is one flight of one vehicle, unless
/// - files are named `[<prefix>_]cf<id>_<run>`, with or without ".csv": folder, prefix and run identify the flight, and
///   if a vehicle has both a binary log and a CSV, the binary log is used;
/// - a CSV file holds the logs of several vehicles, which get the addresses FILE#VEHICLE (logs/vehicles_in_file.h);
/// - `rules` assign them to one flight;
/// - logs of one folder have absolute times (of their clock or of a satellite receiver) that overlap by more than half.
/// A vehicle without a given name is named after its file, `<vehicle>_log07`, or else after its folder.
/// @throws files::InputError if a path does not exist, a given file is not a log, or no log is left.
/// @param by_columns false: a columns.toml names the columns, so that none belong to one of several vehicles by their
///   names
FoundFlights find_flights(const std::vector<std::string>& paths, const LogRules& rules = {},
                          bool by_columns = true);

/// Leaves out logs with the bytes of an earlier one (log_copies.h), and flights that have no other.
void leave_out_copies(FoundFlights& found);

/// Returns the files that hold the logs of `found`, each once.
std::vector<std::string> log_files(const FoundFlights& found);

/// The entry of a vehicle in flights.toml.
struct VehicleUse {
  std::string kind;
  std::string model;           ///< path of its model file
  bool position_only = false;  ///< only a neighbour: its sensors are too poor to judge a force
};

/// Vehicles by name.
using Fleet = std::map<std::string, VehicleUse>;

/// Describes flights.toml.
void describe_flights_file(files::Keys& keys);

/// Reads the tables [vehicle.NAME]; model paths are relative to the file's folder.
/// @throws files::InputError with line and key; also if a model cannot be read.
Fleet read_fleet(const std::string& path);

/// Reads the tables [log."NAME"] of the same file, where NAME may contain wildcards.
/// @throws files::InputError with line and key.
LogRules read_log_rules(const std::string& path);

}  // namespace swarmcert::residuals
