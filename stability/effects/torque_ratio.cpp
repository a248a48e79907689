/// @file Torque of the rotors that differs from the model's by a factor per axis: inertia, arms or thrust.
#include "stability/effects/effect.h"
#include "stability/effects/effect_entry.h"

namespace swarmcert::stability {
namespace {

class TorqueRatio : public Effect {
 public:
  TorqueRatio()
      : Effect({"torque_ratio",
                "tau = (e_x tau_u,x, e_y tau_u,y, e_z tau_u,z), 1 + e = (true torque / modelled torque) "
                "(stated inertia / true inertia)",
                "J omega' = s tau: rates reveal only s / J",
                "torque_ratio",
                "rolls, pitches and turns whose torque exceeds what else acts; set points as steps",
                {{"excess_x", "relative excess of the roll torque over the inertia", 0, -1, 3},
                 {"excess_y", "of the pitch torque", 0, -1, 3},
                 {"excess_z", "of the yaw torque", 0, -1, 3}},
                {}}) {}
  void columns(const Instant& now, const double*, Wrench* columns) const override {
    for (int axis = 0; axis < 3; ++axis)
      columns[axis] = {Eigen::Vector3d::Zero(), now.torque_B_Nm[axis] * Eigen::Vector3d::Unit(axis)};
  }
};

}  // namespace

EffectEntry effects::torque_ratio() { return effect_entry<TorqueRatio>(); }

}  // namespace swarmcert::stability
