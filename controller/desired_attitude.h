/// @file From desired force to collective thrust and desired attitude.
///
/// World frame W: z up. Body frame B: x forward, y left, z up, along the rotors' thrust. R: the desired body frame.
#pragma once

#include <cstdint>

#include "controller/linear_algebra.h"
#include "controller/trigonometry.h"

namespace swarmcert::controller {

/// Desired direction of the nose, seen from above: (cos yaw, sin yaw).
template <typename Scalar>
struct Heading {
  Scalar cosine = Scalar(1), sine = Scalar(0);
};

/// Returns the heading for a yaw measured from W's x axis towards its y axis. NaN if sin_cos() is NaN.
template <typename Scalar>
inline Heading<Scalar> heading_of_yaw(Scalar yaw_rad) {
  const SineCosine<Scalar> s = sin_cos(yaw_rad);
  return {s.cosine, s.sine};
}

/// The case that determined the attitude.
enum class AttitudeCase : std::uint8_t {
  kRegular,
  kForceTooSmall,   ///< the direction of f_d is undefined: the z axis of the fallback is kept
  kHeadingParallel  ///< the thrust is along the heading: y_d follows from y_c
};

template <typename Scalar>
struct DesiredAttitude {
  Matrix3<Scalar> R_WR;
  AttitudeCase which;
};

/// If |z_d x x_c| is below this (half a degree), the heading x_c no longer determines the body's y axis.
inline constexpr double kParallel = 0.01;

/// Returns the attitude whose thrust is along the unit vector `z_W` and whose nose points along `heading`.
///
/// z_d = z_W, y_d = z_d x x_c / |z_d x x_c|, x_d = y_d x z_d, with x_c = (cos yaw, sin yaw, 0) (Lee, Leok and
/// McClamroch 2010). The nose lies in the vertical plane of the heading. This also holds for thrust that points down:
/// the vehicle then flies inverted, with its nose along the heading. If z_d is nearly parallel to x_c (a quarter turn
/// about the y axis), y_d is computed from y_c = (-sin yaw, cos yaw, 0), which is then perpendicular to z_d: x_d = y_c
/// x z_d / |y_c x z_d|, y_d = z_d x x_d. For thrust above the horizon the two cases join continuously. For thrust below
/// it, y_d flips sign; this is unavoidable, since no continuous choice of y_d exists over all directions.
template <typename Scalar>
inline DesiredAttitude<Scalar> attitude_of_axis(const Vector3<Scalar>& z_W, const Heading<Scalar>& heading) {
  const Scalar zero(0);
  const Vector3<Scalar> x_c{heading.cosine, heading.sine, zero};
  const Vector3<Scalar> across = cross(z_W, x_c);
  const Scalar length = norm(across);
  if (length > Scalar(kParallel)) {
    const Vector3<Scalar> y = divided(across, length);
    return {from_columns(cross(y, z_W), y, z_W), AttitudeCase::kRegular};
  }
  const Vector3<Scalar> y_c{-heading.sine, heading.cosine, zero};
  const Vector3<Scalar> along = cross(y_c, z_W);
  const Vector3<Scalar> x = divided(along, norm(along));
  return {from_columns(x, cross(z_W, x), z_W), AttitudeCase::kHeadingParallel};
}

/// Returns the desired attitude for `force_W_N`. If |force| <= smallest_force_N, its direction is not meaningful, and
/// the z axis of `fallback_WR` (the previous desired attitude; initially the identity) is kept.
template <typename Scalar>
inline DesiredAttitude<Scalar> desired_attitude(const Vector3<Scalar>& force_W_N,
                                                const Heading<Scalar>& heading,
                                                const Matrix3<Scalar>& fallback_WR,
                                                const Scalar& smallest_force_N) {
  const Scalar magnitude = norm(force_W_N);
  if (magnitude > smallest_force_N) return attitude_of_axis(divided(force_W_N, magnitude), heading);
  DesiredAttitude<Scalar> kept = attitude_of_axis(z_axis(fallback_WR), heading);
  kept.which = AttitudeCase::kForceTooSmall;
  return kept;
}

/// How the collective thrust is computed from f_d while the attitude has not yet converged.
enum class ThrustRule : std::uint8_t {
  kProjected,  ///< T = f_d . R e_z (Lee 2010): |applied - desired| <= |f_d| sin(angle)
  kMagnitude   ///< T = |f_d| (the earlier firmware): |applied - desired| <= 2 |f_d| sin(angle / 2)
};

/// Returns the collective thrust in newton, never negative, since rotors only push.
template <typename Scalar>
inline Scalar collective_thrust(ThrustRule rule, const Vector3<Scalar>& force_W_N,
                                const Matrix3<Scalar>& R_WB) {
  if (rule == ThrustRule::kMagnitude) return norm(force_W_N);
  return positive_part(dot(force_W_N, z_axis(R_WB)));
}

}  // namespace swarmcert::controller
