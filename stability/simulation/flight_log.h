/// @file Flight logs of simulated vehicles, in the binary format of the published ones ("old" uSD format).
///
/// Header: byte 0 is the number of variables, 35; then `name(type),` for each; then the bitwise NOT of the CRC-32 of
/// everything before. Blocks: u8 n; n records, packed little-endian, 102 bytes each; the bitwise NOT of the CRC-32 of
/// both.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "nn/base/random.h"
#include "stability/simulation/sampled_flight.h"
#include "stability/simulation/sensors.h"

namespace swarmcert::stability {

/// One record, in the units of the log file.
struct LogRecord {
  std::uint32_t tick_us = 0;  ///< since logging was switched on
  std::array<std::int16_t, 9> position_mm_velocity_mm_s_acceleration_mm_s2 = {};  ///< world; specific force
  std::uint32_t quaternion = 0;                   ///< see compress_quaternion()
  std::array<std::int16_t, 3> rates_mrad_s = {};  ///< body
  std::array<std::int16_t, 6> target_mm_mm_s = {};
  float thrust_N = 0;
  std::array<float, 3> torque_Nm = {};
  std::array<float, 4> motor_N = {};
  std::array<std::uint32_t, 4> pwm = {};
  float largest_thrust_gf = 0;  ///< of one motor
  std::uint16_t battery_mV = 0;
  float prediction_gf = 0;
};

/// Returns the contents of the log file.
std::string to_usd_log(const std::vector<LogRecord>& records);

/// Observes a sampled loop and records the log of each vehicle.
class FlightRecorder {
 public:
  /// @param seed for noise and clocks. Each vehicle's clock starts up to 30 ms after the simulation, ticks in
  ///     microseconds, and jitters by 0.1 ms.
  FlightRecorder(SampledFlight& loop, std::uint64_t seed);

  /// Call after every step of the loop.
  void listen();

  const std::vector<LogRecord>& records(int vehicle) const {
    return vehicles_[static_cast<std::size_t>(vehicle)].records;
  }
  /// Moves records(vehicle) out, leaving it empty.
  std::vector<LogRecord> take(int vehicle) {
    return std::move(vehicles_[static_cast<std::size_t>(vehicle)].records);
  }

 private:
  struct Vehicle {
    DelayedSignal delay;  ///< the model's sensor_delay
    LowPass accelerometer;
    files::Random random;
    double start_s;
    std::vector<LogRecord> records;
  };
  LogRecord record(int index, Vehicle& vehicle, const Eigen::Vector3d& specific_force_B);

  SampledFlight& loop_;
  int every_;
  Rows derivative_;  ///< of the state
  std::vector<Vehicle> vehicles_;
};

}  // namespace swarmcert::stability
