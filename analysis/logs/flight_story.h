/// @file Summary of a log: phases, events, battery, and signals that are missing.
#pragma once

#include <string>
#include <vector>

#include "analysis/logs/log.h"

namespace swarmcert::logs {

struct Phase {
  std::string name;               ///< ground, takeoff, flight, landing
  double start_s = 0, end_s = 0;  ///< on the log's clock
};

/// A missing signal that would allow a further judgement.
struct MissingSignal {
  std::string signal;
  std::string needed_for;  ///< what it would make possible
  std::string log_this;    ///< lines for the vehicle's logging configuration
};

struct FlightStory {
  std::vector<Phase> phases;
  std::vector<LogEvent> events;  ///< in chronological order
  std::vector<MissingSignal> missing;
  double air_s = 0;       ///< time in the air
  std::string no_flight;  ///< why the log is not a flight; empty if it is
  double battery_first_V = 0, battery_last_V = 0, battery_least_V = 0;  ///< in the air; 0: not logged
};

FlightStory tell(const Log& log);

/// Returns, for each record, the height at which the vehicle last stood or next stands with idle rotors, whichever is
/// nearer in time; NaN if it never does. It varies because height estimates drift and vehicles also land on tables.
std::vector<double> standing_heights_m(const std::vector<double>& time_s, const std::vector<double>& height_m,
                                       const std::vector<double>& speed_m_s, const std::vector<char>& idle);

/// Returns whether the vehicle is airborne at each record, judged by the thrust and by the height above its last or
/// next resting place.
std::vector<char> airborne(const Log& log);

/// Finds limit cycles of roll or pitch in flight: four or more consecutive periods faster than 1 Hz, each tilting the
/// thrust axis by at least 0.1 rad (a lateral acceleration of a tenth of g), with durations that agree within 30 %. A
/// loop with a damping ratio of 0.1 or more would have lost nine tenths of its amplitude by then, and no trajectory is
/// that regular. Not a limit cycle is one whose set point asks for half of that tilt at the same frequency, as an
/// excitation of the position does. An excitation of attitude, rates or motors is in no set point of a Log: it counts.
/// @param air whether the vehicle is airborne, per record
std::vector<LogEvent> limit_cycles(const Log& log, const std::vector<char>& air);

}  // namespace swarmcert::logs
