/// @file Flights written under random names, units, frames and orders, beside columns of other things.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "analysis/logs/log.h"

namespace swarmcert::tests {

/// A consistent flight of 20 s at one instant, z up and body axes forward, left, up: takeoff, then sums of sines with a
/// turning nose.
struct FlightState {
  logs::Vector position_m{}, velocity_m_s{}, acceleration_m_s2{};
  logs::Attitude attitude;
  logs::Vector specific_force_m_s2{}, rates_rad_s{};  ///< B
  double duty = 0, battery_V = 0;
};

/// @param phase of the sines, so that flights differ
FlightState flight_state(double time_s, double phase);

/// A table as somebody may have written it.
struct SyntheticTable {
  std::string text;
  std::string habits;  ///< what was chosen, in words
  double phase = 0;
  bool has_velocity = false, has_attitude = false, has_specific_force = false, has_rates = false,
       has_duty = false;
};

/// Writes the flight with the habits that `seed` draws: names, stated and unstated units (m, cm, mm; s, ms, us, ns;
/// rad, deg; g), z up or north, east, down, an IMU that differs in that, quaternions of either order or angles, which
/// signals there are, their order, the rate, a calm or a lively flight, and up to four decoys (set points, wind, a
/// payload, a neighbour, a home position, a second accelerometer, a magnetometer).
SyntheticTable synthetic_table(std::uint32_t seed);

/// Names of the signals of `log` that differ from the flight; and of those that the table has and the log lacks.
struct Comparison {
  std::vector<std::string> wrong, missing;
};
Comparison compared(const SyntheticTable& table, const logs::Log& log);

}  // namespace swarmcert::tests
