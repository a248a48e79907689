/// @file Torque against the rotation: rotors that move up and down in a turn have unequal inflow.
#include "stability/effects/effect.h"
#include "stability/effects/effect_entry.h"

namespace swarmcert::stability {
namespace {

/// tau = -D omega. A rotor at distance r from the axis climbs with r omega and loses dT/dv r omega of its thrust, so
/// that D_xy is about 2 r^2 dT/dv of the four.
class RateDamping : public Effect {
 public:
  RateDamping()
      : Effect({"rate_damping",
                "tau = -(D_xy omega_x, D_xy omega_y, D_z omega_z) in the body",
                "inflow of rotors that rise and sink in a turn; the thrust of a rotor falls by T / (2 v_i) "
                "per m/s",
                "rate_damping",
                "fast turns about each axis, with measured rotor speeds or at the rate of the attitude loop",
                {{"damping_xy_N_m_s", "roll and pitch: torque per body rate", 0, 0, 1, {}, Unit::kWeightArm},
                 {"damping_z_N_m_s", "yaw, likewise", 0, 0, 1, {}, Unit::kWeightArm}},
                {}},
               {Family::kNone, Family::kNone, ShownBy::kTurning}) {}
  void columns(const Instant& now, const double*, Wrench* columns) const override {
    const Eigen::Vector3d& omega = now.omega_B_rad_s;
    columns[0] = {Eigen::Vector3d::Zero(), {-omega.x(), -omega.y(), 0}};
    columns[1] = {Eigen::Vector3d::Zero(), {0, 0, -omega.z()}};
  }
};

}  // namespace

EffectEntry effects::rate_damping() { return effect_entry<RateDamping>(); }

}  // namespace swarmcert::stability
