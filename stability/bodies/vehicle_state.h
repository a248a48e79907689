/// @file Layout of a vehicle's state in a vector of doubles, shared by all integrators.
#pragma once

#include <Eigen/Core>

namespace swarmcert::stability {

/// Indices into a vehicle's state. Position and velocity are in the world frame (z up). The quaternion maps body to
/// world and is stored as x, y, z, w, as in logs and in Eigen::Quaterniond::coeffs(). The angular velocity is in the
/// body frame. Rotors: forces behind the motor lag, in the order front right, back right, back left, front left (unused
/// without lag).
enum StateIndex : int { kPosition = 0, kVelocity = 3, kQuaternion = 6, kOmega = 10, kRotors = 13 };
inline constexpr int kVehicleStateSize = 17;
inline constexpr int kNumRotors = 4;

/// Computes the rotation matrix of a quaternion of any nonzero length: R(q) / |q|^2, in row-major order.
template <typename Number>
inline void rotation_of(const Number& x, const Number& y, const Number& z, const Number& w, Number (&R)[9]) {
  const Number one(1), s = Number(2) / (w * w + x * x + y * y + z * z);
  const Number xx = s * x * x, yy = s * y * y, zz = s * z * z;
  const Number xy = s * x * y, xz = s * x * z, yz = s * y * z;
  const Number wx = s * w * x, wy = s * w * y, wz = s * w * z;
  R[0] = one - yy - zz, R[1] = xy - wz, R[2] = xz + wy;
  R[3] = xy + wz, R[4] = one - xx - zz, R[5] = yz - wx;
  R[6] = xz - wy, R[7] = yz + wx, R[8] = one - xx - yy;
}

/// @param q x, y, z, w
inline void rotation_of(const double* q, Eigen::Matrix3d* R_WB) {
  double R[9];
  rotation_of(q[0], q[1], q[2], q[3], R);
  *R_WB = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(R);
}

}  // namespace swarmcert::stability
