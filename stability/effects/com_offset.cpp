#include "stability/effects/com_offset.h"

namespace swarmcert::stability {

EffectInfo ComOffset::describe() {
  return {
      "com_offset",
      "tau = -c x T e3 = T (-c_y, c_x, 0) in the body",
      "lever of the thrust about a centre of mass that is c away from the centre of the rotors",
      "centre of mass / weak rotor",
      "climbs and descents that change the thrust by more than 10 % of the weight; turn the battery or the "
      "load by 180 degrees and fly again to tell it from a weak rotor",
      {{"offset_x_m", "c_x: of the centre of mass, body x", 0, -0.1, 0.1},
       {"offset_y_m", "c_y", 0, -0.1, 0.1}},
      {}};
}

void ComOffset::columns(const Instant& now, const double*, Wrench* columns) const {
  columns[0] = {Eigen::Vector3d::Zero(), now.thrust_N * Eigen::Vector3d::UnitY()};
  columns[1] = {Eigen::Vector3d::Zero(), -now.thrust_N * Eigen::Vector3d::UnitX()};
}

}  // namespace swarmcert::stability
