/// @file Thrust scale, mass or payload: f = e T b3. A flight's kinematics depend only on the ratio of thrust to mass.
#include "stability/effects/effect.h"
#include "stability/effects/effect_entry.h"

namespace swarmcert::stability {
namespace {

class ThrustRatio : public Effect {
 public:
  ThrustRatio()
      : Effect({"thrust_ratio",
                "f = e T b3, where 1 + e = (true thrust / mapped thrust) (stated mass / true mass)",
                "m a = s T: kinematics reveal only s / m",
                "mass / payload / thrust scale",
                "thrust changes of more than 15 %; weigh the vehicle to separate mass from thrust",
                {{"ratio", "relative excess of thrust over mass", 0, -0.9, 4}},
                {}},
               {Family::kThrustScale, Family::kNone, ShownBy::kForce, SetPoints::kBesideRemainder}) {}
  void columns(const Instant& now, const double*, Wrench* columns) const override {
    columns[0] = {now.thrust_N * now.b3_W(), Eigen::Vector3d::Zero()};
  }
};

}  // namespace

EffectEntry effects::thrust_ratio() { return effect_entry<ThrustRatio>(); }

}  // namespace swarmcert::stability
