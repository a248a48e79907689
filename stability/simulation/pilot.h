/// @file The flight code of controller/ bound to one vehicle's gains and model, for simulation.
#pragma once

#include <variant>

#include "controller/flight_controller.h"
#include "stability/bodies/lanes.h"
#include "stability/gains.h"
#include "stability/model.h"
#include "stability/simulation/lanes_mixing.h"

namespace swarmcert::stability {

/// Scalar is float (as in flight), Lanes (eight such vehicles at once) or double (for integrators).
template <typename Scalar>
class Pilot {
 public:
  /// Attitude gains are those of public Crazyflie firmware, scaled with the model's inertia: for the Lee law k_R 7e-3 N
  /// m, k_omega 1.15e-3 N m s (8e-3 and 2e-3 in yaw); for the robust law the gains used in flight (Lambda 10 1/s, 4 in
  /// yaw; K_omega 2e-3, 1e-3; K_I 2e-3, 4e-3 N m, limit 2 rad). The largest rotor force is that of the thrust map.
  /// @param attitude_step_s period of step(). 0: the caller integrates, and step() depends on its inputs alone, as
  ///     continuous integrators require.
  Pilot(const Gains& gains, const Model& model, double attitude_step_s);

  /// Calls controller::flight_step().
  controller::FlightCommand<Scalar> step(controller::FlightMemory<Scalar>& memory,
                                         const controller::Measured<Scalar>& measured,
                                         const controller::FlightReference<Scalar>& reference,
                                         Scalar prediction_N, std::uint32_t now_ms, bool position_is_due,
                                         const controller::Vector3<Scalar>& torque_prediction_Nm = {}) const;

  /// The rotor forces that step() commands.
  struct Push {
    std::uint8_t faults;
    bool motors_off;
    controller::Wrench<Scalar> wanted;
    controller::RotorForces<Scalar> forces;
  };
  /// Does what step() does, without computing or remembering PWM, as simulations call this millions of times.
  Push push(controller::FlightMemory<Scalar>& memory, const controller::Measured<Scalar>& measured,
            const controller::FlightReference<Scalar>& reference, Scalar prediction_N,
            std::uint32_t now_ms = 0, bool position_is_due = true,
            const controller::Vector3<Scalar>& torque_prediction_Nm = {}) const;
  /// Returns the collective thrust that push() commands.
  Scalar wanted_thrust_N(controller::FlightMemory<Scalar> memory,
                         const controller::Measured<Scalar>& measured,
                         const controller::FlightReference<Scalar>& reference, Scalar prediction_N) const;

  /// Returns omega - omega_r, which the robust law integrates, after a step() or push() with the same `measured`; 0 for
  /// the Lee law.
  controller::Vector3<Scalar> rate_error(const controller::FlightMemory<Scalar>& memory,
                                         const controller::Measured<Scalar>& measured) const;

  /// Returns f(settings) with the settings of controller::flight_step().
  template <typename F>
  auto with_settings(F&& f) const {
    return std::visit(std::forward<F>(f), settings_);
  }

 private:
  template <typename Position>
  using Settings = controller::FlightSettings<Scalar, Position>;
  std::variant<Settings<controller::PidGains<Scalar>>, Settings<controller::CompositeGains<Scalar>>>
      settings_;
};

extern template class Pilot<float>;
extern template class Pilot<double>;
extern template class Pilot<Lanes>;

}  // namespace swarmcert::stability
