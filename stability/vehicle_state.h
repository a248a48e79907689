/// @file How a vehicle's state lies in a vector of doubles, for every integrator alike.
#pragma once

#include <Eigen/Core>

namespace swarmcert::stability {

/// Places in a vehicle's state. Position and velocity in the world (z up); the quaternion (w, x, y, z) takes body to
/// world; angular velocity in the body; rotors: force behind the motor lag, front right, back right, back left, front
/// left (unused without lag).
enum StateIndex : int { kPosition = 0, kVelocity = 3, kQuaternion = 6, kOmega = 10, kRotors = 13 };
inline constexpr int kVehicleStateSize = 17;
inline constexpr int kNumRotors = 4;

/// The rotation of a quaternion (w, x, y, z) of any length but 0: R(q) / |q|^2.
inline void rotation_of(const double* q, Eigen::Matrix3d* R_WB) {
  const double w = q[0], x = q[1], y = q[2], z = q[3];
  const double s = 2 / (w * w + x * x + y * y + z * z);
  const double xx = s * x * x, yy = s * y * y, zz = s * z * z;
  const double xy = s * x * y, xz = s * x * z, yz = s * y * z;
  const double wx = s * w * x, wy = s * w * y, wz = s * w * z;
  *R_WB << 1 - yy - zz, xy - wz, xz + wy,  //
      xy + wz, 1 - xx - zz, yz - wx,       //
      xz - wy, yz + wx, 1 - xx - yy;
}

}  // namespace swarmcert::stability
