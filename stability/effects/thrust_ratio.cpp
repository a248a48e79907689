#include "stability/effects/thrust_ratio.h"

namespace swarmcert::stability {

EffectInfo ThrustRatio::describe() {
  return {"thrust_ratio",
          "f = e T b3, where 1 + e = (true thrust / mapped thrust) (stated mass / true mass)",
          "m a = s T: kinematics show s / m only",
          "mass / payload / thrust scale",
          "thrust changes of more than 15 %; weigh the vehicle to tell mass from thrust",
          {{"ratio", "relative excess of thrust over mass", 0, -0.7, 0.7}},
          {}};
}

void ThrustRatio::columns(const Instant& now, const double*, Wrench* columns) const {
  columns[0] = {now.thrust_N * now.b3_W(), Eigen::Vector3d::Zero()};
}

}  // namespace swarmcert::stability
