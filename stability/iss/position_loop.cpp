#include "stability/iss/position_loop.h"

#include <algorithm>
#include <cmath>

#include "stability/gains_matrices.h"

namespace swarmcert::stability {
namespace {

using Map = Eigen::Map<const Eigen::Vector3d>;

enum Block : int { kP = 0, kV = 3, kI = 6, kMotor = 9, kAttitude = 12 };

}  // namespace

PositionLoop::PositionLoop(const Gains& gains, const Model& model)
    : limit_m_s_(gains.integrator_limit_m_s),
      mass_kg_(model.mass_kg),
      motor_s_(gains.motor_lag_s),
      attitude_s_(gains.attitude_lag_s),
      largest_N_(model.largest_thrust_N(kFullBattery_V)) {
  if (gains.composite) {
    // f_d = m v_r' - K s: -(m Lambda^2 + 2 K Lambda) p~ - (2 m Lambda + K) v - K Lambda^2 I.
    const Eigen::Matrix3d lambda = to_eigen(gains.composite->Lambda_1_s),
                          k = to_eigen(gains.composite->K_kg_s);
    position_ = mass_kg_ * lambda * lambda + 2 * k * lambda;
    velocity_ = 2 * mass_kg_ * lambda + k;
    integral_ = k * lambda * lambda;
  } else {
    position_ = mass_kg_ * to_eigen(gains.pid->Kp_1_s2).asDiagonal().toDenseMatrix();
    velocity_ = mass_kg_ * to_eigen(gains.pid->Kd_1_s).asDiagonal().toDenseMatrix();
    integral_ = mass_kg_ * to_eigen(gains.pid->Ki_1_s3).asDiagonal().toDenseMatrix();
    // If the integrator step differs from the period, the effective Ki differs from the written one.
    if (gains.rate_hz > 0 && gains.integrator_step_s > 0)
      integral_ *= gains.integrator_step_s * gains.rate_hz;
  }
}

Eigen::Vector3d PositionLoop::feedback(const double* x) const {
  Eigen::Vector3d clamped = Map(x + kI);
  for (int i = 0; i < 3; ++i) {
    const double limit = limit_m_s_[static_cast<std::size_t>(i)];
    clamped[i] = std::clamp(clamped[i], -limit, limit);
  }
  return -(position_ * Map(x + kP) + velocity_ * Map(x + kV) + integral_ * clamped);
}

Eigen::Vector3d PositionLoop::commanded_N(const double* x) const {
  Eigen::Vector3d force = feedback(x);
  force.z() += mass_kg_ * kGravity_m_s2;
  return force;
}

const char* PositionLoop::left_hypothesis(const double* x) const {
  /// Below this fraction of the weight, the direction of the commanded force is meaningless.
  constexpr double kLeastShare = 0.01;
  for (int i = 0; i < 3; ++i) {
    if (!(std::abs(x[kI + i]) < limit_m_s_[static_cast<std::size_t>(i)]))
      return "the integral reaches its clamp";
  }
  const Eigen::Vector3d force = commanded_N(x);
  const double size_N = force.stableNorm();
  if (!(size_N <= largest_N_)) return "the thrust saturates";
  if (size_N < kLeastShare * mass_kg_ * kGravity_m_s2) return "the commanded force is near zero";
  return force.z() > 0 ? nullptr : "the commanded force tilts by 90 degrees";
}

void PositionLoop::derivative(const double* x, const Eigen::Vector3d& eps_W_N, double* dx) const {
  Eigen::Vector3d force = commanded_N(x);
  if (const double size = force.norm(); size > largest_N_) force *= largest_N_ / size;
  Eigen::Vector3d motor = force, applied = force;
  if (motor_s_ > 0) motor = Map(x + kMotor);
  applied = motor;
  if (attitude_s_ > 0) applied.head<2>() = Map(x + kAttitude).head<2>();
  for (int i = 0; i < 3; ++i) {
    dx[kP + i] = x[kV + i];
    dx[kV + i] = (applied[i] - eps_W_N[i]) / mass_kg_ - (i == 2 ? kGravity_m_s2 : 0);
    const double limit = limit_m_s_[static_cast<std::size_t>(i)];
    const bool held = std::abs(x[kI + i]) >= limit && x[kI + i] * x[kP + i] > 0;
    dx[kI + i] = held ? 0 : x[kP + i];
    dx[kMotor + i] = motor_s_ > 0 ? (force[i] - x[kMotor + i]) / motor_s_ : 0;
    dx[kAttitude + i] = attitude_s_ > 0 && i < 2 ? (motor[i] - x[kAttitude + i]) / attitude_s_ : 0;
  }
}

PositionLoop::State PositionLoop::start(const Eigen::Vector3d& position_m,
                                        const Eigen::Vector3d& velocity_m_s) const {
  State state = State::Zero();
  state.segment<3>(kP) = position_m;
  state.segment<3>(kV) = velocity_m_s;
  state[kMotor + 2] = state[kAttitude + 2] = mass_kg_ * kGravity_m_s2;
  return state;
}

Eigen::Matrix<double, PositionLoop::kSize, PositionLoop::kSize> PositionLoop::matrix() const {
  Eigen::Matrix<double, kSize, kSize> a = Eigen::Matrix<double, kSize, kSize>::Zero();
  const Eigen::Matrix3d one = Eigen::Matrix3d::Identity();
  a.block<3, 3>(kP, kV) = one;
  a.block<3, 3>(kI, kP) = one;
  // States of absent lags are kept, decaying, but unused.
  constexpr double kUnread_1_s = 1e3;
  Eigen::Matrix<double, 3, kSize> force = Eigen::Matrix<double, 3, kSize>::Zero();
  force.block<3, 3>(0, kP) = -position_;
  force.block<3, 3>(0, kV) = -velocity_;
  force.block<3, 3>(0, kI) = -integral_;
  Eigen::Matrix<double, 3, kSize> motor = force;
  a.block<3, 3>(kMotor, kMotor) = -kUnread_1_s * one;
  a.block<3, 3>(kAttitude, kAttitude) = -kUnread_1_s * one;
  if (motor_s_ > 0) {
    a.middleRows<3>(kMotor) = force / motor_s_;
    a.block<3, 3>(kMotor, kMotor) -= one / motor_s_;
    motor.setZero();
    motor.block<3, 3>(0, kMotor) = one;
  }
  Eigen::Matrix<double, 3, kSize> applied = motor;
  if (attitude_s_ > 0) {
    a.middleRows<2>(kAttitude) = motor.topRows<2>() / attitude_s_;
    a.block<2, 2>(kAttitude, kAttitude) -= one.topLeftCorner<2, 2>() / attitude_s_;
    applied.topRows<2>().setZero();
    applied.block<2, 2>(0, kAttitude) = one.topLeftCorner<2, 2>();
  }
  a.middleRows<3>(kV) = applied / mass_kg_;
  return a;
}

}  // namespace swarmcert::stability
