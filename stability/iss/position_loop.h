/// @file The translational closed loop in continuous time, about a point at rest.
#pragma once

#include <Eigen/Core>

#include "stability/iss/iss_check.h"

namespace swarmcert::stability {

/// States: p~, v, integral, force behind the motor lag, force behind the attitude lag; in the world frame, three each.
class PositionLoop {
 public:
  static constexpr int kSize = 15;
  using State = Eigen::Matrix<double, kSize, 1>;

  explicit PositionLoop(const FlownLoop& loop);

  /// Computes dx/dt at the state x under the learning error `eps` (f_a_hat - f_a, in newton).
  void derivative(const double* x, const Eigen::Vector3d& eps_W_N, double* dx) const;

  /// Returns the hypothesis of the tracking theorem that fails in the state x, in words; null if all hold. They are:
  /// the commanded force is at most what the rotors give, is not near zero and points above the horizon (an attitude
  /// law turns the vehicle towards it), and no integral has reached its clamp.
  const char* left_hypothesis(const double* x) const;

  /// Returns the initial state with these errors: integral 0, forces that balance the weight.
  State start(const Eigen::Vector3d& position_m, const Eigen::Vector3d& velocity_m_s) const;

  /// Returns FlownLoop::matrix(): d state = A state + B eps; eps enters v as -eps / m.
  const Eigen::Matrix<double, kSize, kSize>& matrix() const { return matrix_; }

  double mass_kg() const { return mass_kg_; }

 private:
  Eigen::Vector3d feedback(const double* x) const;
  Eigen::Vector3d commanded_N(const double* x) const;

  Eigen::Matrix3d position_, velocity_, integral_;  ///< f_d = m g - position_ p~ - velocity_ v - integral_ I
  PerAxis limit_m_s_;
  Eigen::Matrix<double, kSize, kSize> matrix_;
  double mass_kg_, motor_s_, attitude_s_;
  Interval thrust_N_;
};

}  // namespace swarmcert::stability
