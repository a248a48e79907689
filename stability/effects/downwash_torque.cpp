#include "stability/effects/downwash_torque.h"

#include <Eigen/Geometry>

#include "controller/mixing.h"

namespace swarmcert::stability {
namespace {

/// Place of the arm in theta; what comes before is Downwash's.
constexpr int kArm = 7;

}  // namespace

EffectInfo DownwashTorque::describe() {
  EffectInfo info = Downwash::describe();
  info.name = info.equivalence_class = "downwash_torque";
  info.equation = "tau = sum_k r_k x R' (0, 0, f_k), f_k: a quarter of downwash at rotor k";
  info.source = "blade forces in the wake that downwash describes; its defaults, Crazyflie arms";
  info.excitation =
      "logs at the rate of the attitude loop: pass below another vehicle, 0.2 .. 0.6 m, to all sides of it";
  for (Parameter& parameter : info.shape) parameter.grid.clear();
  info.shape.push_back({"arm_m", "from the centre to each of the four rotors, in X", 0.046, 0.01, 1});
  return info;
}

void DownwashTorque::columns(const Instant& now, const double* shape, Wrench* columns) const {
  const controller::Rotors<double> rotors = controller::crazyflie_rotors(shape[kArm], 0.0);
  columns[0] = {};
  Instant at = now;
  for (int k = 0; k < rotors.count; ++k) {
    const Eigen::Vector3d r_B_m(rotors.at[k].x_m, rotors.at[k].y_m, 0);
    const Eigen::Vector3d r_W_m = now.R_WB * r_B_m;
    at_rotor_.assign(now.neighbours, now.neighbours + now.num_neighbours);
    for (Neighbour& neighbour : at_rotor_) neighbour.dp_W_m -= r_W_m;
    at.neighbours = at_rotor_.data();
    Wrench quarter;
    downwash_.columns(at, shape, &quarter);
    columns[0].torque_B_Nm += r_B_m.cross(now.R_WB.transpose() * quarter.force_W_N) / rotors.count;
  }
}

bool DownwashTorque::in_support(const Instant& now, const double* shape) const {
  return downwash_.in_support(now, shape);
}

double DownwashTorque::reach_m(double dz_m, const double* shape) const {
  const double reach_m = downwash_.reach_m(dz_m + shape[kArm], shape);
  return reach_m > 0 ? reach_m + shape[kArm] : 0;
}

}  // namespace swarmcert::stability
