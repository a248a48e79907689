#include "stability/simulation/simulate.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace swarmcert::stability {
namespace {

/// Accumulates squares and maxima of one vehicle's error.
struct Sums {
  std::array<double, 4> max = {}, squares = {};
  std::int64_t count = 0;

  void add(const Eigen::Vector3d& error) {
    const double size[4] = {std::abs(error.x()), std::abs(error.y()), std::abs(error.z()), error.norm()};
    for (std::size_t i = 0; i < 4; ++i) {
      max[i] = std::max(max[i], size[i]);
      squares[i] += size[i] * size[i];
    }
    ++count;
  }

  TrackingError result() const {
    TrackingError error;
    error.max_m = max;
    for (std::size_t i = 0; i < 4; ++i) {
      error.rms_m[i] = count > 0 ? std::sqrt(squares[i] / static_cast<double>(count)) : 0;
    }
    return error;
  }
};

}  // namespace

Simulation simulate(Swarm& swarm, const Gains& gains, const Task& task, const SimulationOptions& options,
                    const files::Network* network) {
  constexpr double kLost_m = 100;
  SampledFlight loop(swarm, gains, task, options.loop, network);
  FlightRecorder recorder(loop, options.loop.seed);
  const auto vehicles = static_cast<std::size_t>(swarm.size());
  std::vector<Sums> sums(vehicles);
  std::vector<std::int64_t> saturated(vehicles);
  std::vector<double> most_tilted(vehicles, 1.0);  ///< smallest cosine of the tilt
  Simulation simulation;
  simulation.vehicles.resize(vehicles);
  simulation.errors.resize(vehicles);
  for (SimulatedVehicle& vehicle : simulation.vehicles) {
    vehicle.smallest_height_m = std::numeric_limits<double>::infinity();
  }
  const auto periods = static_cast<std::int64_t>(std::llround(task.duration_s() / loop.period_s()));
  Setpoint setpoint;
  for (std::int64_t k = 0; k < periods && !simulation.diverged; ++k) {
    loop.step();
    if (options.keep_logs) recorder.listen();
    for (std::size_t i = 0; i < vehicles; ++i) {
      const int vehicle = static_cast<int>(i);
      if (loop.is_saturated(vehicle)) ++saturated[i];
      if (!loop.ran_position() || loop.input(vehicle).resting) continue;
      const double* const x = loop.state() + i * kVehicleStateSize;
      const Eigen::Vector3d p(x[0], x[1], x[2]);
      setpoint = task.at(vehicle, loop.time_s());
      const Eigen::Vector3d error = p - setpoint.p_W_m;
      if (!(error.norm() < kLost_m)) {
        simulation.diverged = true;
        break;
      }
      sums[i].add(error);
      // The third component of the thrust axis, whose angle to the vertical is the tilt.
      const double* const q = x + kQuaternion;
      const double length2 = q[3] * q[3] + q[0] * q[0] + q[1] * q[1] + q[2] * q[2];
      most_tilted[i] = std::min(most_tilted[i], 1 - 2 * (q[0] * q[0] + q[1] * q[1]) / length2);
      SimulatedVehicle& result = simulation.vehicles[i];
      result.smallest_height_m = std::min(result.smallest_height_m, p.z());
      if (options.keep_errors && k % 5 == 0) {
        simulation.errors[i].push_back(
            {static_cast<float>(loop.time_s()), static_cast<float>(error.x()), static_cast<float>(error.y()),
             static_cast<float>(error.z()), static_cast<float>(setpoint.p_W_m.x()),
             static_cast<float>(setpoint.p_W_m.y()), static_cast<float>(setpoint.p_W_m.z())});
      }
    }
    if (options.progress && k % 500 == 0) options.progress(loop.time_s(), task.duration_s());
  }
  simulation.end_s = loop.time_s();
  for (std::size_t i = 0; i < vehicles; ++i) {
    SimulatedVehicle& result = simulation.vehicles[i];
    result.kind = swarm.model(static_cast<int>(i)).kind;
    result.error = sums[i].result();
    result.saturated_share =
        static_cast<double>(saturated[i]) / static_cast<double>(std::max<std::int64_t>(loop.period(), 1));
    result.largest_tilt_rad = std::acos(std::clamp(most_tilted[i], -1.0, 1.0));
    if (sums[i].count == 0) result.smallest_height_m = options.loop.ground_m;
    if (options.keep_logs) simulation.logs.push_back(recorder.take(static_cast<int>(i)));
  }
  return simulation;
}

}  // namespace swarmcert::stability
