#include "analysis/identification/scan/balance_columns.h"

#include <Eigen/LU>

#include "analysis/residuals/force_residual.h"
#include "analysis/residuals/torque_residual.h"

namespace swarmcert::identification {
namespace {

constexpr std::size_t kBalancedRotors = 4;
constexpr Eigen::Index kBalanceColumns = 7;

/// Returns the matrix from (force along b3, torque) to rotor forces.
Eigen::Matrix4d inverse_mixing(const stability::Model& model,
                               const std::vector<stability::RotorPlace>& rotors) {
  Eigen::Matrix4d mixing;
  for (std::size_t k = 0; k < kBalancedRotors; ++k)
    mixing.col(static_cast<Eigen::Index>(k)) << 1, rotors[k].y_m, -rotors[k].x_m,
        rotors[k].yaw_m(model.torque_per_thrust_m);
  return mixing.inverse();
}

}  // namespace

Eigen::MatrixXd balance_columns(const stability::Model& model, const residuals::Inputs& inputs,
                                const residuals::Track& track) {
  const std::vector<Eigen::Vector3d> torque_B_Nm = residuals::torque_records(model, inputs.kinds, track);
  if (torque_B_Nm.empty()) return {};
  Eigen::MatrixXd columns =
      Eigen::MatrixXd::Zero(kBalanceColumns, static_cast<Eigen::Index>(torque_B_Nm.size()));
  for (std::size_t i = 0; i < torque_B_Nm.size(); ++i)
    columns.col(static_cast<Eigen::Index>(i)).head<3>() = torque_B_Nm[i];
  const std::vector<stability::RotorPlace> rotors = rotor_places(model);
  if (rotors.size() != kBalancedRotors || track.judged.minCoeff() < 1) return columns;
  const Eigen::Matrix4d to_rotors = inverse_mixing(model, rotors);
  const auto force_W_N = residuals::force_residual(model, inputs.kinds, inputs.rules, track);
  for (std::size_t i = 0; i < torque_B_Nm.size(); ++i) {
    Eigen::Vector4d wrench;
    wrench << track.instants[i].b3_W().dot(force_W_N[i]), torque_B_Nm[i];
    columns.col(static_cast<Eigen::Index>(i)).tail<4>() = to_rotors * wrench;
  }
  return columns;
}

}  // namespace swarmcert::identification
