/// @file Offset of the centre of mass from the centre of the rotors.
#include "stability/effects/effect.h"
#include "stability/effects/effect_entry.h"

namespace swarmcert::stability {
namespace {

/// tau = -c x T e3 = T (-c_y, c_x, 0) in the body frame, c the position of the centre of mass relative to the centre of
/// the rotors. The vertical component of c does not affect the torque of forces along e3.
class ComOffset : public Effect {
 public:
  ComOffset()
      : Effect({"com_offset",
                "tau = -c x T e3 = T (-c_y, c_x, 0) in the body",
                "lever arm of the thrust about a centre of mass offset by c from the centre of the rotors",
                "centre of mass / weak rotor",
                "climbs and descents that change the thrust by more than 10 % of the weight; turn the "
                "battery or the "
                "load by 180 degrees and fly again to distinguish it from a weak rotor",
                {{"offset_x_m", "c_x: of the centre of mass, body x", 0, -1, 1, {}, Unit::kArm},
                 {"offset_y_m", "c_y", 0, -1, 1, {}, Unit::kArm}},
                {}},
               {Family::kLever, Family::kNone, ShownBy::kTorques}) {}
  void columns(const Instant& now, const double*, Wrench* columns) const override {
    columns[0] = {Eigen::Vector3d::Zero(), now.thrust_N * Eigen::Vector3d::UnitY()};
    columns[1] = {Eigen::Vector3d::Zero(), -now.thrust_N * Eigen::Vector3d::UnitX()};
  }
};

}  // namespace

EffectEntry effects::com_offset() { return effect_entry<ComOffset>(); }

}  // namespace swarmcert::stability
