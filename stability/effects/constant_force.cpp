#include "stability/effects/constant_force.h"

namespace swarmcert::stability {

EffectInfo ConstantForce::describe() {
  return {"constant_force",
          "f = (f_x, f_y, f_z) in the world",
          "what wind times linear drag, a tilted thrust axis and a biased accelerometer have in common",
          "wind / tilt / IMU bias",
          "yaw through more than 90 degrees (world against body), tilt changes (bias against thrust axis)",
          {{"force_x_N", "world x", 0, -0.3, 0.3},
           {"force_y_N", "world y", 0, -0.3, 0.3},
           {"force_z_N", "world z", 0, -0.3, 0.3}},
          {}};
}

void ConstantForce::columns(const Instant&, const double*, Wrench* columns) const {
  for (int axis = 0; axis < 3; ++axis) columns[axis] = {Eigen::Vector3d::Unit(axis), Eigen::Vector3d::Zero()};
}

}  // namespace swarmcert::stability
