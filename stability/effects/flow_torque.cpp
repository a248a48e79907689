/// @file Torque of the flow through the rotors: in forward flight the nose rises.
#include "stability/effects/effect.h"
#include "stability/effects/effect_entry.h"

namespace swarmcert::stability {
namespace {

/// tau = (c_x v_y, -c_y v_x, 0), v the velocity in the body: the advancing side of a rotor lifts more, and blades flap
/// away from the flow.
class FlowTorque : public Effect {
 public:
  FlowTorque()
      : Effect({"flow_torque",
                "tau = (c_x v_y, -c_y v_x, 0) in the body",
                "blade flapping and rotors above the centre of mass: Hoffmann et al., Quadrotor Helicopter "
                "Flight Dynamics and Control, AIAA 2007-6461",
                "flow_torque",
                "speeds over a range of 3 to 1 along both body axes",
                {{"flow_x_N_s", "roll torque per sideward speed", 0, -0.001, 0.001},
                 {"flow_y_N_s", "pitch torque per forward speed", 0, -0.001, 0.001}},
                {}}) {}
  void columns(const Instant& now, const double*, Wrench* columns) const override {
    const Eigen::Vector3d v_B = now.R_WB.transpose() * now.v_W_m_s;
    columns[0] = {Eigen::Vector3d::Zero(), v_B.y() * Eigen::Vector3d::UnitX()};
    columns[1] = {Eigen::Vector3d::Zero(), -v_B.x() * Eigen::Vector3d::UnitY()};
  }
};

}  // namespace

EffectEntry effects::flow_torque() { return effect_entry<FlowTorque>(); }

}  // namespace swarmcert::stability
