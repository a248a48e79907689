/// @file One simulated flight: a task flown in the sampled loop, its errors and its logs.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "stability/simulation/flight_log.h"
#include "stability/simulation/sampled_flight.h"

namespace swarmcert::stability {

/// Magnitude of p - p_d over a flight, per world axis and as a vector, from take-off on.
struct TrackingError {
  std::array<double, 4> max_m = {};  ///< |x|, |y|, |z|, Euclidean norm
  std::array<double, 4> rms_m = {};
};

struct SimulatedVehicle {
  std::string kind;
  TrackingError error;
  double saturated_share = 0;  ///< of control periods in which thrust was at its limit
  double largest_tilt_rad = 0;
  double smallest_height_m = 0;
};

struct Simulation {
  std::vector<SimulatedVehicle> vehicles;
  std::vector<std::vector<LogRecord>> logs;  ///< by vehicle; empty unless requested
  /// By vehicle, every position period: t, p - p_d, p_d.
  std::vector<std::vector<std::array<float, 7>>> errors;
  bool diverged = false;  ///< a state became infinite or exceeded 100 m; ends the flight
  double end_s = 0;
};

struct SimulationOptions {
  SampledFlightOptions loop;
  bool keep_logs = true;
  bool keep_errors = true;
  std::function<void(double time_s, double duration_s)> progress;
};

/// Flies `task` with the vehicles of `swarm`. @throws the same exceptions as SampledFlight.
Simulation simulate(Swarm& swarm, const Gains& gains, const Task& task, const SimulationOptions& options,
                    const files::Network* network = nullptr);

}  // namespace swarmcert::stability
