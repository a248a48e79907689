/// @file From tracking error to desired force: the paper's position law, and the PID law of stock firmware.
///
/// World frame W: z up, gravity (0, 0, -g). The tracking error is p~ = p - p_d, and I is its integral.
#pragma once

#include "controller/linear_algebra.h"

namespace swarmcert::controller {

/// Standard gravity as used by the analysed firmware, in m/s^2.
inline constexpr double kGravity_m_s2 = 9.81;

/// p~ and its derivative, in W.
template <typename Scalar>
struct TrackingError {
  Vector3<Scalar> position_m;
  Vector3<Scalar> velocity_m_s;
};

/// Feed-forward terms of both laws, in W.
template <typename Scalar>
struct FeedForward {
  Vector3<Scalar> acceleration_m_s2;  ///< p_d''
  Vector3<Scalar>
      predicted_effect_N;  ///< f_a_hat: predicted interaction force from other vehicles; 0 if unknown
};

/// Gains of the paper's equations (8) and (9). The tracking theorem requires both to be symmetric positive definite.
template <typename Scalar>
struct CompositeGains {
  Matrix3<Scalar> Lambda_1_s;
  Matrix3<Scalar> K_kg_s;
};

/// Gains in the form used by firmware: accelerations, per axis.
template <typename Scalar>
struct PidGains {
  Vector3<Scalar> Kp_1_s2;
  Vector3<Scalar> Kd_1_s;
  Vector3<Scalar> Ki_1_s3;
};

/// Returns f_d = m v_r_dot - K s - m g - f_a_hat in newton, in W, with the composite variable s = p~' + 2 Lambda p~ +
/// Lambda^2 I and the reference acceleration v_r_dot = p_d'' - 2 Lambda p~' - Lambda^2 p~ (paper, section IV-A).
template <typename Scalar>
inline Vector3<Scalar> desired_force(const CompositeGains<Scalar>& gains, const Scalar& mass_kg,
                                     const TrackingError<Scalar>& error, const Vector3<Scalar>& integral_m_s,
                                     const FeedForward<Scalar>& feed_forward) {
  const Matrix3<Scalar>& lambda = gains.Lambda_1_s;
  const Scalar two(2);
  const Vector3<Scalar> lambda_p = lambda * error.position_m;
  const Vector3<Scalar> s = error.velocity_m_s + scaled(two, lambda_p) + lambda * (lambda * integral_m_s);
  const Vector3<Scalar> v_r_dot =
      feed_forward.acceleration_m_s2 - scaled(two, lambda * error.velocity_m_s) - lambda * lambda_p;
  Vector3<Scalar> force = scaled(mass_kg, v_r_dot) - gains.K_kg_s * s;
  force.z = force.z + product(mass_kg, Scalar(kGravity_m_s2));
  return force - feed_forward.predicted_effect_N;
}

/// Returns f_d = m (p_d'' - Kd p~' - Kp p~ - Ki I) - m g - f_a_hat in newton, in W.
template <typename Scalar>
inline Vector3<Scalar> desired_force(const PidGains<Scalar>& gains, const Scalar& mass_kg,
                                     const TrackingError<Scalar>& error, const Vector3<Scalar>& integral_m_s,
                                     const FeedForward<Scalar>& feed_forward) {
  const Vector3<Scalar> acceleration =
      feed_forward.acceleration_m_s2 - diagonal_product(gains.Kd_1_s, error.velocity_m_s) -
      diagonal_product(gains.Kp_1_s2, error.position_m) - diagonal_product(gains.Ki_1_s3, integral_m_s);
  Vector3<Scalar> force = scaled(mass_kg, acceleration);
  force.z = force.z + product(mass_kg, Scalar(kGravity_m_s2));
  return force - feed_forward.predicted_effect_N;
}

/// How the integral of p~ is computed.
template <typename Scalar>
struct Integrator {
  /// Limit on |I| per axis; infinite: no limit. A clamped integral cancels a constant force of at most m Ki limit.
  Vector3<Scalar> limit_m_s;
  /// Time step by which p~ is multiplied in each execution of the position loop: the period of the loop. Public
  /// firmware runs the loop at 100 Hz but uses 1/500 s here, which makes Ki effectively five times weaker than its
  /// nominal value.
  Scalar step_s;
};

/// Axes on which the integral is held.
struct HeldAxes {
  bool x = false, y = false, z = false;
};

/// Anti-windup by conditional integration: while the thrust is at its upper limit, returns the axes on which the next
/// step of the integral would increase `force_N` further. Without saturation, no axis is held.
template <typename Scalar>
inline HeldAxes held_axes(const PidGains<Scalar>& gains, const Vector3<Scalar>& position_error_m,
                          const Vector3<Scalar>& force_N, bool thrust_saturated) {
  if (!thrust_saturated) return {};
  const Vector3<Scalar> push = -diagonal_product(gains.Ki_1_s3, position_error_m);
  const Scalar zero(0);
  return {product(push.x, force_N.x) > zero, product(push.y, force_N.y) > zero,
          product(push.z, force_N.z) > zero};
}

/// Same for composite gains. Lambda and K couple the axes, so all are held if the whole step would increase the force.
template <typename Scalar>
inline HeldAxes held_axes(const CompositeGains<Scalar>& gains, const Vector3<Scalar>& position_error_m,
                          const Vector3<Scalar>& force_N, bool thrust_saturated) {
  if (!thrust_saturated) return {};
  const Vector3<Scalar> push = -(gains.K_kg_s * (gains.Lambda_1_s * (gains.Lambda_1_s * position_error_m)));
  const bool outward = dot(push, force_N) > Scalar(0);
  return {outward, outward, outward};
}

/// Returns the integral after one more execution: I + step p~, clamped, on the axes that are not held. Use the result
/// in the same execution, since that is the sampled loop that the bounds analyse.
template <typename Scalar>
inline Vector3<Scalar> integrate(const Integrator<Scalar>& integrator, const Vector3<Scalar>& integral_m_s,
                                 const Vector3<Scalar>& position_error_m, const HeldAxes& held = {}) {
  const Vector3<Scalar> next = integral_m_s + scaled(integrator.step_s, position_error_m);
  const Vector3<Scalar>& limit = integrator.limit_m_s;
  return {held.x ? integral_m_s.x : clamp(next.x, -limit.x, limit.x),
          held.y ? integral_m_s.y : clamp(next.y, -limit.y, limit.y),
          held.z ? integral_m_s.z : clamp(next.z, -limit.z, limit.z)};
}

}  // namespace swarmcert::controller
