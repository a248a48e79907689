/// @file A multirotor simulator that shares no equations with stability/, as ground truth for tests of identification.
///
/// Point-mass translation, attitude that follows its command through a rate loop, rotors of first or second order,
/// forces as any C++ function. Semi-implicit Euler at 1 kHz, with errors far below the sensor noise. Only the bytes of
/// the log come from the library (stability/simulation/flight_log.h), because the format is tested elsewhere.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace swarmcert::tests {

/// The variables on which a hidden force may depend.
struct Moment {
  double time_s = 0;
  Eigen::Vector3d p_m, v_m_s;
  Eigen::Vector3d b1, b2, b3;  ///< body axes, in the world
  double thrust_N = 0;         ///< after the rotor lag
  double battery_V = 4.2;
  struct Other {
    Eigen::Vector3d dp_m;  ///< its position minus ours
    Eigen::Vector3d v_m_s;
  };
  std::vector<Other> others;
};

/// Differences between the vehicles and the model file.
struct Truth {
  double mass_factor = 1;
  double thrust_factor = 1;
  double battery_1_V = 0;   ///< relative thrust per volt above that of a full battery
  double motor_lag_s = 0;   ///< first pole
  double motor_lag2_s = 0;  ///< second pole: with both, a second-order motor
  double command_delay_s = 0;
  double sensor_delay_s = 0;
  Eigen::Vector3d imu_bias_m_s2 = Eigen::Vector3d::Zero();  ///< in the body frame
  double gust_N = 0;  ///< standard deviation per axis of a first-order process
  double gust_time_s = 0.5;
  std::function<Eigen::Vector3d(const Moment&)> force_N;  ///< empty: none
};

enum class Program {
  kRich,   ///< heights from FlightPlan::lowest_m to 1 m, about 0.6 m/s rms
  kSlow,   ///< heights 0.3 .. 0.6 m, about 0.1 m/s rms
  kHover,  ///< stays within a few millimetres of 0.5 m
};

/// A Crazyflie, or a larger vehicle with the same flight: its thrust grows with its mass.
struct Craft {
  double mass_kg = 0.034;
  int cells = 1;  ///< in series
};

/// Returns the model file of the vehicle.
std::string model_of(const Craft& craft);

struct FlightPlan {
  Program program = Program::kRich;
  int vehicles = 1;
  double duration_s = 40;
  std::uint64_t seed = 0;
  double lowest_m = 0.085;  ///< of the rich program
  Craft craft = {};
  double log_hz = 100;  ///< a divisor of 1000
};

/// Simulates a flight and writes `folder`/cf<1 ...>_<run>.
void fly(const Truth& truth, const FlightPlan& plan, const std::string& folder, int run = 0);

}  // namespace swarmcert::tests
