#include "stability/iss/position_loop.h"

#include <algorithm>
#include <cmath>

namespace swarmcert::stability {
namespace {

using Map = Eigen::Map<const Eigen::Vector3d>;

enum Block : int { kP = 0, kV = 3, kI = 6, kMotor = 9, kAttitude = 12 };

}  // namespace

PositionLoop::PositionLoop(const FlownLoop& loop)
    : limit_m_s_{loop.integral_limit_m_s(0), loop.integral_limit_m_s(1), loop.integral_limit_m_s(2)},
      matrix_(loop.matrix()),
      mass_kg_(loop.plant.mass_kg),
      motor_s_(loop.gains.motor_lag_s),
      attitude_s_(loop.gains.attitude_lag_s),
      thrust_N_(loop.thrust_range_N()) {
  const PidMatrices law = loop.law();
  position_ = mass_kg_ * law.Kp;
  velocity_ = mass_kg_ * law.Kd;
  integral_ = mass_kg_ * law.Ki;
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
  if (!(size_N <= thrust_N_.upper && size_N >= thrust_N_.lower)) return "the thrust saturates";
  if (size_N < kLeastShare * mass_kg_ * kGravity_m_s2) return "the commanded force is near zero";
  return force.z() > 0 ? nullptr : "the commanded force tilts by 90 degrees";
}

void PositionLoop::derivative(const double* x, const Eigen::Vector3d& eps_W_N, double* dx) const {
  Eigen::Vector3d force = commanded_N(x);
  if (const double size = force.norm(); size > thrust_N_.upper) force *= thrust_N_.upper / size;
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

}  // namespace swarmcert::stability
