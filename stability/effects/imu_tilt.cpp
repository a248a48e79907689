#include "stability/effects/imu_tilt.h"

namespace swarmcert::stability {

EffectInfo ImuTilt::describe() {
  return {"imu_tilt",
          "f = T R (t x e3), t = (tilt_x, tilt_y, 0)",
          "a board that is not parallel to the rotors; 1 degree gives 1.7 % of the weight to the side",
          "IMU tilt / IMU bias",
          "yaw through more than 90 degrees: a wind keeps its direction, a tilt turns with the vehicle",
          {{"tilt_x_rad", "of the rotors against the inertial unit, about body x", 0, -0.3, 0.3},
           {"tilt_y_rad", "about body y", 0, -0.3, 0.3}},
          {}};
}

void ImuTilt::columns(const Instant& now, const double*, Wrench* columns) const {
  columns[0] = {-now.thrust_N * now.R_WB.col(1), Eigen::Vector3d::Zero()};
  columns[1] = {now.thrust_N * now.R_WB.col(0), Eigen::Vector3d::Zero()};
}

}  // namespace swarmcert::stability
