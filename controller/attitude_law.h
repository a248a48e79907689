/// @file Attitude laws, from attitude error to torque: geometric control on SE(3), and a robust nonlinear law.
///
/// Frames: W world, B body, R desired body. R_RB = R_WR' R_WB is the attitude error and theta its rotation angle.
/// Angular velocities are in rad/s and torques in N m, both in B unless the name ends in _R.
#pragma once

#include "controller/linear_algebra.h"

namespace swarmcert::controller {

/// The measured attitude and angular velocity of the vehicle.
template <typename Scalar>
struct AttitudeState {
  Matrix3<Scalar> R_WB;
  Vector3<Scalar> omega_B_rad_s;
};

/// The attitude setpoint. The angular velocity and its derivative are those of the desired frame, expressed in R.
template <typename Scalar>
struct AttitudeReference {
  Matrix3<Scalar> R_WR;
  Vector3<Scalar> omega_R_rad_s{};
  Vector3<Scalar> omega_dot_R_rad_s2{};
};

/// Attitude and angular velocity error.
template <typename Scalar>
struct AttitudeError {
  Matrix3<Scalar> R_RB;
  Vector3<Scalar> reference_omega_B_rad_s;  ///< R_RB' omega_R
  Vector3<Scalar>
      reference_omega_dot_B_rad_s2;  ///< derivative of the above: R_RB' omega_dot_R - omega x (R_RB' omega_R)
  Vector3<Scalar> omega_error_B_rad_s;  ///< omega_B - R_RB' omega_R
};

template <typename Scalar>
inline AttitudeError<Scalar> attitude_error(const AttitudeState<Scalar>& state,
                                            const AttitudeReference<Scalar>& reference) {
  AttitudeError<Scalar> error;
  error.R_RB = transpose(reference.R_WR) * state.R_WB;
  const Matrix3<Scalar> R_BR = transpose(error.R_RB);
  error.reference_omega_B_rad_s = R_BR * reference.omega_R_rad_s;
  error.reference_omega_dot_B_rad_s2 =
      R_BR * reference.omega_dot_R_rad_s2 - cross(state.omega_B_rad_s, error.reference_omega_B_rad_s);
  error.omega_error_B_rad_s = state.omega_B_rad_s - error.reference_omega_B_rad_s;
  return error;
}

/// Returns e_R = (R_RB - R_RB')^v / 2, which is sin(theta) times the rotation axis, in B.
template <typename Scalar>
inline Vector3<Scalar> rotation_error(const Matrix3<Scalar>& R_RB) {
  const Scalar half(0.5);
  return {product(half, R_RB.z.y - R_RB.y.z), product(half, R_RB.x.z - R_RB.z.x),
          product(half, R_RB.y.x - R_RB.x.y)};
}

/// Gains of the geometric law, per body axis. The proof of the law assumes equal k_R in all axes.
template <typename Scalar>
struct LeeGains {
  Vector3<Scalar> k_R_N_m;
  Vector3<Scalar> k_omega_N_m_s;
};

/// Returns tau = -k_R e_R - k_omega e_omega + omega x J omega - J (omega x R_RB' omega_d - R_RB' omega_d_dot).
///
/// Lee, Leok, McClamroch, "Geometric tracking control of a quadrotor UAV on SE(3)", CDC 2010, eq. (11). The error
/// decays exponentially from every attitude error except a rotation by pi, and slowly near it
/// (tests/controller/attitude_decay.h).
template <typename Scalar>
inline Vector3<Scalar> lee_torque(const LeeGains<Scalar>& gains, const Matrix3<Scalar>& inertia_kg_m2,
                                  const AttitudeState<Scalar>& state, const AttitudeError<Scalar>& error) {
  const Vector3<Scalar>& omega = state.omega_B_rad_s;
  return cross(omega, inertia_kg_m2 * omega) + inertia_kg_m2 * error.reference_omega_dot_B_rad_s2 -
         diagonal_product(gains.k_R_N_m, rotation_error(error.R_RB)) -
         diagonal_product(gains.k_omega_N_m_s, error.omega_error_B_rad_s);
}

/// Returns the modified Rodrigues parameters sigma = tan(theta / 4) times the rotation axis, |sigma| <= 1.
///
/// Computed through the unit quaternion, largest component first (Shepperd 1978), so that no divisor is less than 1 and
/// the result is accurate at every angle. At theta = pi exactly, both signs of the axis are valid; one of them is
/// returned.
template <typename Scalar>
inline Vector3<Scalar> modified_rodrigues(const Matrix3<Scalar>& r) {
  const Scalar one(1), zero(0);
  const Scalar t = trace(r);
  // The quaternion (w, v) times a common positive factor.
  Scalar w = one + t;
  Vector3<Scalar> v{r.z.y - r.y.z, r.x.z - r.z.x, r.y.x - r.x.y};
  if (!(t > r.x.x && t > r.y.y && t > r.z.z)) {
    if (r.x.x >= r.y.y && r.x.x >= r.z.z) {
      w = r.z.y - r.y.z;
      v = {one + r.x.x - r.y.y - r.z.z, r.x.y + r.y.x, r.x.z + r.z.x};
    } else if (r.y.y >= r.z.z) {
      w = r.x.z - r.z.x;
      v = {r.x.y + r.y.x, one + r.y.y - r.x.x - r.z.z, r.y.z + r.z.y};
    } else {
      w = r.y.x - r.x.y;
      v = {r.x.z + r.z.x, r.y.z + r.z.y, one + r.z.z - r.x.x - r.y.y};
    }
  }
  const Scalar length = square_root(product(w, w) + dot(v, v));
  return w < zero ? divided(-v, length - w) : divided(v, length + w);
}

/// Gains of the robust law, per body axis.
template <typename Scalar>
struct RobustGains {
  Vector3<Scalar> Lambda_1_s;
  Vector3<Scalar> K_omega_N_m_s;
  Vector3<Scalar> K_I_N_m;             ///< of the integral of omega - omega_r
  Vector3<Scalar> integral_limit_rad;  ///< largest |integral| per axis
};

/// The reference angular velocity omega_r of the robust law and its derivative, in B.
template <typename Scalar>
struct ReferenceRate {
  Vector3<Scalar> omega_r_rad_s;
  Vector3<Scalar> omega_r_dot_rad_s2;
};

/// Returns omega_r = R_RB' omega_d - 4 Lambda sigma and its derivative, with
/// 4 sigma_dot = (1 - |sigma|^2) omega_e + 2 sigma x omega_e + 2 sigma (sigma . omega_e).
/// For small errors 4 sigma is the rotation vector, so Lambda is the bandwidth of the attitude loop.
template <typename Scalar>
inline ReferenceRate<Scalar> reference_rate(const Vector3<Scalar>& Lambda_1_s, const Vector3<Scalar>& sigma,
                                            const AttitudeError<Scalar>& error) {
  const Scalar two(2), four(4);
  const Vector3<Scalar>& omega_e = error.omega_error_B_rad_s;
  const Vector3<Scalar> four_sigma_dot = scaled(Scalar(1) - dot(sigma, sigma), omega_e) +
                                         scaled(two, cross(sigma, omega_e)) +
                                         scaled(product(two, dot(sigma, omega_e)), sigma);
  return {error.reference_omega_B_rad_s - diagonal_product(Lambda_1_s, scaled(four, sigma)),
          error.reference_omega_dot_B_rad_s2 - diagonal_product(Lambda_1_s, four_sigma_dot)};
}

/// Returns tau = J omega_r_dot - (J omega) x omega_r - K_omega (omega - omega_r) - K_I integral(omega - omega_r).
///
/// The attitude law of the paper's section IV (given there in a comment of the source, after Morgan et al. 2016 and
/// Bandyopadhyay, Chung and Hadaegh 2016, who leave the choice of attitude coordinates open). With the coordinates
/// above, the error decays exponentially at one rate from every attitude (tests/controller/attitude_decay.h).
template <typename Scalar>
inline Vector3<Scalar> robust_torque(const RobustGains<Scalar>& gains, const Matrix3<Scalar>& inertia_kg_m2,
                                     const Vector3<Scalar>& omega_B_rad_s, const ReferenceRate<Scalar>& rate,
                                     const Vector3<Scalar>& rate_integral_rad) {
  return inertia_kg_m2 * rate.omega_r_dot_rad_s2 - cross(inertia_kg_m2 * omega_B_rad_s, rate.omega_r_rad_s) -
         diagonal_product(gains.K_omega_N_m_s, omega_B_rad_s - rate.omega_r_rad_s) -
         diagonal_product(gains.K_I_N_m, rate_integral_rad);
}

/// Returns the integral of omega - omega_r after one more period, clamped per axis.
template <typename Scalar>
inline Vector3<Scalar> integrate_rate(const RobustGains<Scalar>& gains, const Vector3<Scalar>& integral_rad,
                                      const Vector3<Scalar>& omega_B_rad_s,
                                      const Vector3<Scalar>& omega_r_rad_s, const Scalar& step_s) {
  const Vector3<Scalar> next = integral_rad + scaled(step_s, omega_B_rad_s - omega_r_rad_s);
  const Vector3<Scalar>& limit = gains.integral_limit_rad;
  return {clamp(next.x, -limit.x, limit.x), clamp(next.y, -limit.y, limit.y),
          clamp(next.z, -limit.z, limit.z)};
}

}  // namespace swarmcert::controller
