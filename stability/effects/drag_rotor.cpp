/// @file Drag of the rotors in their own plane, in proportion to thrust: f = -k (T / (m g)) (I - b3 b3') v.
#include "stability/effects/effect.h"
#include "stability/effects/effect_entry.h"

namespace swarmcert::stability {
namespace {

class DragRotor : public Effect {
 public:
  DragRotor()
      : Effect({"drag_rotor",
                "f = -k (T / (m g)) (I - b3 b3') v",
                "induced drag of rotors: Mahony, Kumar and Corke 2012; Faessler, Franchi and Scaramuzza 2018",
                "drag_rotor",
                "horizontal speeds over a range of 3 to 1 while thrust changes; tilt of more than 10 degrees",
                {{"drag_N_s_m",
                  "force per speed in the rotor plane, at hover thrust",
                  0,
                  0,
                  0.1,
                  {},
                  Unit::kDrag}},
                {}},
               {Family::kDrag, Family::kDrag, ShownBy::kForce, SetPoints::kNotNeeded, velocity_variables()}) {
  }
  void columns(const Instant& now, const double*, Wrench* columns) const override {
    const Eigen::Vector3d b3 = now.b3_W();
    const Eigen::Vector3d in_plane = now.v_W_m_s - b3 * b3.dot(now.v_W_m_s);
    columns[0] = {-(now.thrust_N / (now.mass_kg * kGravity_m_s2)) * in_plane, Eigen::Vector3d::Zero()};
  }
  bool in_support(const Instant& now, const double*) const override { return now.v_W_m_s.norm() > 0.1; }
};

}  // namespace

EffectEntry effects::drag_rotor() { return effect_entry<DragRotor>(); }

}  // namespace swarmcert::stability
