/// @file Gyroscopic torque of rotors that do not spin equally fast.
#include <algorithm>
#include <cmath>

#include "stability/effects/effect.h"
#include "stability/effects/effect_entry.h"

namespace swarmcert::stability {
namespace {

/// tau = -omega x h e3 with the angular momentum h of the rotors. With yaw torque tau_z = -kappa k sum s W^2 and thrust
/// T = k sum W^2 of rotors of nearly equal speed W (s = 1: counterclockwise), h = J_r sum s W = -t tau_z sqrt(m g / T),
/// where t = J_r / (2 kappa k W_hover).
class Gyroscopic : public Effect {
 public:
  Gyroscopic()
      : Effect({"gyroscopic",
                "tau = -omega x h e3, h = -t tau_u,z sqrt(m g / T)",
                "angular momentum of the rotors: Mahony, Kumar, Corke, Multirotor Aerial Vehicles, IEEE "
                "Robotics & Automation Magazine 2012",
                "gyroscopic",
                "turning quickly about the vertical while rolling or pitching",
                {{"time_s", "t: momentum of the rotors per yaw torque in hover", 0, 0, 1}},
                {}}) {}
  void columns(const Instant& now, const double*, Wrench* columns) const override {
    const double thrust_N = std::max(now.thrust_N, 0.1 * now.mass_kg * kGravity_m_s2);
    const double momentum = -now.torque_B_Nm.z() * std::sqrt(now.mass_kg * kGravity_m_s2 / thrust_N);
    const Eigen::Vector3d& omega = now.omega_B_rad_s;
    columns[0] = {Eigen::Vector3d::Zero(), momentum * Eigen::Vector3d(-omega.y(), omega.x(), 0)};
  }
};

}  // namespace

EffectEntry effects::gyroscopic() { return effect_entry<Gyroscopic>(); }

}  // namespace swarmcert::stability
