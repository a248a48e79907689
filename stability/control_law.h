/// @file The laws of controller/ bound to one vehicle's gains and model. No state: loops keep integrals themselves.
#pragma once

#include <limits>

#include "controller/attitude_law.h"
#include "controller/desired_attitude.h"
#include "controller/mixing.h"
#include "controller/position_law.h"
#include "stability/gains.h"
#include "stability/model.h"

namespace swarmcert::stability {

/// Scalar is float, as it flies, or double, for integrators.
template <typename Scalar>
class ControlLaw {
 public:
  using Vector = controller::Vector3<Scalar>;
  using Matrix = controller::Matrix3<Scalar>;

  /// Attitude gains are those of public Crazyflie firmware, scaled with the model's inertia: the Lee controller's
  /// (k_R 7e-3 N m, k_omega 1.15e-3 N m s; 8e-3 and 2e-3 in yaw), and the flown gains of the robust law (Lambda 10 1/s,
  /// 4 in yaw; K_omega 2e-3, 1e-3; K_I 2e-3, 4e-3 N m, limit 2 rad).
  ControlLaw(const Gains& gains, const Model& model);

  /// f_d in the world. `integral` is that of the position error.
  Vector force(const controller::TrackingError<Scalar>& error, const Vector& integral_m_s,
               const controller::FeedForward<Scalar>& feed_forward) const {
    return is_composite_ ? desired_force(composite_, mass_kg_, error, integral_m_s, feed_forward)
                         : desired_force(pid_, mass_kg_, error, integral_m_s, feed_forward);
  }

  controller::HeldAxes held(const Vector& position_error_m, const Vector& force_N, bool saturated) const {
    return is_composite_ ? held_axes(composite_, position_error_m, force_N, saturated)
                         : held_axes(pid_, position_error_m, force_N, saturated);
  }

  /// Rotor forces for f_d, and what they were asked for.
  struct Output {
    Scalar thrust_N;
    Vector torque_B_N_m;
    controller::Mixed<Scalar> mixed;
    Vector rate_error_B_rad_s;  ///< what the robust law integrates; 0 for the geometric law
    Matrix R_WR;                ///< desired attitude
  };
  /// @param fallback_WR    previous desired attitude, for a force without direction.
  /// @param rate_integral  of Output::rate_error_B_rad_s; used by the robust law.
  Output rotors(const Vector& force_W_N, const Matrix& R_WB, const Vector& omega_B_rad_s,
                const Matrix& fallback_WR, const Vector& rate_integral_rad,
                const controller::ForceLimits<Scalar>& limits) const;

  const controller::Integrator<Scalar>& integrator() const { return integrator_; }
  const Vector& rate_integral_limit_rad() const { return robust_.integral_limit_rad; }
  bool is_robust() const { return is_robust_; }
  Scalar mass_kg() const { return mass_kg_; }

 private:
  bool is_composite_ = false, is_robust_ = false;
  Scalar mass_kg_;
  controller::CompositeGains<Scalar> composite_;
  controller::PidGains<Scalar> pid_;
  controller::Integrator<Scalar> integrator_;
  controller::LeeGains<Scalar> lee_;
  controller::RobustGains<Scalar> robust_;
  Matrix inertia_kg_m2_;
  controller::Allocation<Scalar> allocation_;
};

extern template class ControlLaw<float>;
extern template class ControlLaw<double>;

/// What each rotor can give at this battery voltage, from the thrust map.
template <typename Scalar>
controller::ForceLimits<Scalar> force_limits(const Model& model, double battery_V) {
  return {static_cast<Scalar>(model.thrust.force_N(model.thrust.pwm(0, battery_V), battery_V)),
          static_cast<Scalar>(model.thrust.largest_N(battery_V))};
}

}  // namespace swarmcert::stability
