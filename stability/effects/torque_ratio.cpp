/// @file Torque of the rotors that differs from the model's: another inertia, arm or drag of the propellers.
#include "stability/effects/effect.h"
#include "stability/effects/effect_entry.h"

namespace swarmcert::stability {
namespace {

/// tau = c tau_u. Predictions depend on (1 + c) / J alone, so that an inertia too small by a third shows as c = -1/4.
class TorqueRatio : public Effect {
 public:
  TorqueRatio()
      : Effect({"torque_ratio",
                "tau = (change_x tau_x, change_y tau_y, change_z tau_z), of the torque of the rotors",
                "inertia, arms and propeller drag of a model are often those of another vehicle",
                "torque ratio / inertia",
                "fast turns about each axis, with measured rotor speeds or at the rate of the attitude loop",
                {{"change_x", "roll: actual torque over the model's, less 1", 0, -1, 3},
                 {"change_y", "pitch, likewise", 0, -1, 3},
                 {"change_z", "yaw, likewise", 0, -1, 3}},
                {}},
               {Family::kNone, Family::kNone, ShownBy::kTurning}) {}
  void columns(const Instant& now, const double*, Wrench* columns) const override {
    for (int axis = 0; axis < 3; ++axis)
      columns[axis] = {Eigen::Vector3d::Zero(), now.torque_B_Nm[axis] * Eigen::Vector3d::Unit(axis)};
  }
};

}  // namespace

EffectEntry effects::torque_ratio() { return effect_entry<TorqueRatio>(); }

}  // namespace swarmcert::stability
