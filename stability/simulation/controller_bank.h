/// @file The flight code of all vehicles of a swarm with its
/// memory; several vehicles at once, with the same bits.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "stability/gains.h"
#include "stability/simulation/swarm.h"
#include "stability/tasks/task.h"

namespace swarmcert::stability {

/// What one vehicle's controller was asked and what it answered in one control period.
struct ControlRecord {
  Setpoint setpoint;
  double prediction_N = 0;                                           ///< f_a_hat along z, as applied
  Eigen::Vector3d torque_prediction_B_Nm = Eigen::Vector3d::Zero();  ///< tau_a_hat, as applied
  std::array<double, kNumRotors> rotor_N = {};                       ///< commands before the delay
  bool motors_off = false;
  bool saturated = false;   ///< thrust was held at its upper limit
  std::uint8_t faults = 0;  ///< sum of controller::Fault
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

  /// New measurements of a vehicle's position and velocity, valid until the next call.
  virtual void see(int vehicle, const Eigen::Vector3d& p_W_m, const Eigen::Vector3d& v_W_m_s,
                   std::uint32_t stamp_ms) = 0;
  /// Set point of a vehicle until the next call.
  virtual void follow(int vehicle, const Setpoint& setpoint) = 0;
  /// f_a_hat along z and tau_a_hat, until the next call; 0 before the first.
  virtual void predict(int vehicle, double prediction_N, const Eigen::Vector3d& torque_B_Nm) = 0;
  virtual void reset_integrals(int vehicle) = 0;
  /// One control period of every vehicle: controller::flight_step().
  /// @param rows    the swarm's state in rows (rigid_bodies.h); attitudes and rates are read from it.
  /// @param records by vehicle: the answers, except those of report().
  virtual void step(const double* rows, double battery_V, std::uint32_t now_ms, bool position_is_due,
                    std::vector<ControlRecord>& records) = 0;
  /// Completes a vehicle's record of the last step() with what only logs need.
  virtual void report(int vehicle, ControlRecord* record) const = 0;
};

/// Controllers in float, as they fly. Three vehicles of one kind or more run in the lanes of one Lanes; those that do
/// not take the same path through the code (thrust at its limit in some, say) run apart, a run for each path.
/// @param period_s of the control loop.
std::unique_ptr<ControllerBank> make_float_bank(const Swarm& swarm, const Gains& gains, double period_s);
/// The same code in double.
std::unique_ptr<ControllerBank> make_double_bank(const Swarm& swarm, const Gains& gains, double period_s);

}  // namespace swarmcert::stability
