/// @file Torque of the air that flows across the rotors.
#include "stability/effects/effect.h"
#include "stability/effects/effect_entry.h"

namespace swarmcert::stability {
namespace {

/// tau = k v_B x e3 = k (v_y, -v_x, 0): blades that advance into the flow have more lift than those that retreat and
/// flap back, and drag acts above the centre of mass. Either turns the thrust axis away from the direction of flight.
class FlowTorque : public Effect {
 public:
  FlowTorque()
      : Effect({"flow_torque",
                "tau = k (v_y, -v_x, 0), v the velocity in the body",
                "flapping of the blades and drag above the centre of mass; about 20 rad/s^2 per m/s on a "
                "vehicle of 45 g",
                "flow_torque",
                "horizontal flight at several speeds, with measured rotor speeds or at the rate of the "
                "attitude loop",
                {{"moment_N_s", "k: torque per speed", 0, -1, 1, {}, Unit::kWeightArm}},
                {}},
               {Family::kNone, Family::kNone, ShownBy::kTurning}) {}
  void columns(const Instant& now, const double*, Wrench* columns) const override {
    const Eigen::Vector3d v_B_m_s = now.R_WB.transpose() * now.v_W_m_s;
    columns[0] = {Eigen::Vector3d::Zero(), {v_B_m_s.y(), -v_B_m_s.x(), 0}};
  }
};

}  // namespace

EffectEntry effects::flow_torque() { return effect_entry<FlowTorque>(); }

}  // namespace swarmcert::stability
