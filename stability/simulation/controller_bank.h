/// @file Controllers of all vehicles of a swarm.
///
/// Runs the flight code with its memory for several vehicles at once, bitwise identical to running each alone.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "stability/gains.h"
#include "stability/simulation/swarm.h"
#include "stability/tasks/task.h"

namespace swarmcert::stability {

/// Inputs and outputs of one vehicle's controller in one control period.
struct ControlRecord {
  Setpoint setpoint;
  double prediction_N = 0;                                           ///< f_a_hat along z, as applied
  Eigen::Vector3d torque_prediction_B_Nm = Eigen::Vector3d::Zero();  ///< tau_a_hat, as applied
  std::array<double, kNumRotors> rotor_N = {};                       ///< commands before the delay
  bool motors_off = false;
  bool saturated = false;   ///< thrust was limited to its maximum
  std::uint8_t faults = 0;  ///< bitwise or of controller::Fault
  // Needed by logs only; see ControllerBank::report().
  Eigen::Vector3d force_W_N = Eigen::Vector3d::Zero();  ///< f_d
  double thrust_N = 0;
  Eigen::Vector3d torque_B_Nm = Eigen::Vector3d::Zero();
  std::array<std::uint16_t, kNumRotors> pwm = {};
  Eigen::Vector3d integral_m_s = Eigen::Vector3d::Zero();
};

class ControllerBank {
 public:
  virtual ~ControllerBank() = default;

  /// Passes new measurements of a vehicle's position and velocity, valid until the next call.
  virtual void see(int vehicle, const Eigen::Vector3d& p_W_m, const Eigen::Vector3d& v_W_m_s,
                   std::uint32_t stamp_ms) = 0;
  /// Sets the setpoint of a vehicle, valid until the next call.
  virtual void follow(int vehicle, const Setpoint& setpoint) = 0;
  /// Sets f_a_hat along z and tau_a_hat, valid until the next call; 0 before the first.
  virtual void predict(int vehicle, double prediction_N, const Eigen::Vector3d& torque_B_Nm) = 0;
  virtual void reset_integrals(int vehicle) = 0;
  /// Runs one control period of every vehicle: controller::flight_step().
  /// @param rows the swarm's state in rows (rigid_bodies.h), from which attitudes and rates are read.
  /// @param records by vehicle: the outputs, except those of report().
  virtual void step(const double* rows, double battery_V, std::uint32_t now_ms, bool position_is_due,
                    std::vector<ControlRecord>& records) = 0;
  /// Completes a vehicle's record of the last step() with the fields that only logs need.
  virtual void report(int vehicle, ControlRecord* record) const = 0;
};

/// Makes controllers in float, as in flight. Three or more vehicles of one kind share the lanes of one Lanes; if they
/// take different paths through the code (for example because thrust saturates in some), each path is run separately.
/// @param period_s period of the control loop.
std::unique_ptr<ControllerBank> make_float_bank(const Swarm& swarm, const Gains& gains, double period_s);
/// Makes the same controllers in double precision.
std::unique_ptr<ControllerBank> make_double_bank(const Swarm& swarm, const Gains& gains, double period_s);

}  // namespace swarmcert::stability
