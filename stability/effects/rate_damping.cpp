/// @file Damping of the body rates: blades that advance into the turn lift more.
#include "stability/effects/effect.h"
#include "stability/effects/effect_entry.h"

namespace swarmcert::stability {
namespace {

class RateDamping : public Effect {
 public:
  RateDamping()
      : Effect({"rate_damping",
                "tau = -(d_x omega_x, d_y omega_y, d_z omega_z)",
                "rotors that sink by the turn meet more inflow from below: Padfield, Helicopter Flight "
                "Dynamics, 2nd edition, 2.3.2",
                "rate_damping",
                "turns about each axis that last longer than the attitude loop needs",
                {{"damping_x_Nm_s", "torque per roll rate", 0, 0, 0.001},
                 {"damping_y_Nm_s", "per pitch rate", 0, 0, 0.001},
                 {"damping_z_Nm_s", "per yaw rate", 0, 0, 0.001}},
                {}}) {}
  void columns(const Instant& now, const double*, Wrench* columns) const override {
    for (int axis = 0; axis < 3; ++axis)
      columns[axis] = {Eigen::Vector3d::Zero(), -now.omega_B_rad_s[axis] * Eigen::Vector3d::Unit(axis)};
  }
};

}  // namespace

EffectEntry effects::rate_damping() { return effect_entry<RateDamping>(); }

}  // namespace swarmcert::stability
