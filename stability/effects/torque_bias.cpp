/// @file A constant torque: centre of gravity off the thrust axis, unequal rotors.
#include "stability/effects/effect.h"
#include "stability/effects/effect_entry.h"

namespace swarmcert::stability {
namespace {

class TorqueBias : public Effect {
 public:
  TorqueBias()
      : Effect({"torque_bias",
                "tau = (tau_x, tau_y, tau_z) in the body",
                "a centre of gravity 1.4 mm off gives 4.6e-4 N m on a Crazyflie",
                "torque_bias",
                "logs at the rate of the attitude loop: slower logs show only the mean torque",
                {{"torque_x_Nm", "body x", 0, -1, 1, {}, Unit::kWeightArm},
                 {"torque_y_Nm", "body y", 0, -1, 1, {}, Unit::kWeightArm},
                 {"torque_z_Nm", "body z", 0, -1, 1, {}, Unit::kWeightArm}},
                {}},
               {Family::kTorque, Family::kNone, ShownBy::kTorques}) {}
  void columns(const Instant&, const double*, Wrench* columns) const override {
    for (int axis = 0; axis < 3; ++axis)
      columns[axis] = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Unit(axis)};
  }
};

}  // namespace

EffectEntry effects::torque_bias() { return effect_entry<TorqueBias>(); }

}  // namespace swarmcert::stability
