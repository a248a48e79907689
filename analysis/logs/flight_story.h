/// @file What happened in a log, and what it should have logged: phases, events, battery, missing signals.
#pragma once

#include <string>
#include <vector>

#include "analysis/logs/log.h"

namespace swarmcert::logs {

struct Phase {
  std::string name;               ///< ground, takeoff, flight, landing
  double start_s = 0, end_s = 0;  ///< of the log's clock
};

/// A signal that would let more be judged.
struct MissingSignal {
  std::string signal;
  std::string needed_for;  ///< what it would make possible
  std::string log_this;    ///< lines of the vehicle's own logging configuration
};

struct FlightStory {
  std::vector<Phase> phases;
  std::vector<LogEvent> events;  ///< in order of time
  std::vector<MissingSignal> missing;
  double air_s = 0;                                                     ///< in the air
  std::string no_flight;                                                ///< why this is no flight; else empty
  double battery_first_V = 0, battery_last_V = 0, battery_least_V = 0;  ///< in the air; 0: not logged
};

FlightStory tell(const Log& log);

/// The height at which a vehicle stands with idle rotors, per record: where it stood last or stands next, whichever is
/// nearer in time; NaN where it never does. Estimates of the height drift, and there are tables.
std::vector<double> standing_heights_m(const std::vector<double>& time_s, const std::vector<double>& height_m,
                                       const std::vector<double>& speed_m_s, const std::vector<char>& idle);

/// Per record: in the air. By the thrust and by the height above where the vehicle stood with idle rotors.
std::vector<char> airborne(const Log& log);

}  // namespace swarmcert::logs
