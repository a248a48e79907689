/// @file Torque due to the downwash of the vehicles above, which differs between the rotors.
///
/// The wake of downwash.h is evaluated at each of the four rotors r_k (body frame, X arrangement) instead of the
/// centre:
///   tau_B = sum_k r_k x R' (0, 0, f_k),   f_k = -(A / 4) (sum_j g_j(p_j - p - R r_k)^p)^(1/p).
/// If the arm a is short compared with the wake, a level vehicle has tau = a^2 / 2 (d f_z / dy, -d f_z / dx, 0): the
/// slope of the vertical downwash force over the vehicle's own position. The force itself belongs to the effect
/// `downwash`; a model that wants both must name both.
#include <Eigen/Geometry>
#include <vector>

#include "controller/mixing.h"
#include "stability/effects/downwash.h"
#include "stability/effects/effect_entry.h"

namespace swarmcert::stability {
namespace {

/// Index of the arm in theta; the indices before it are those of Downwash.
constexpr int kArm = 7;

class DownwashTorque : public Effect {
 public:
  DownwashTorque() : Effect(describe()) {}
  static EffectInfo describe() {
    EffectInfo info = Downwash::describe();
    info.name = info.equivalence_class = "downwash_torque";
    info.equation = "tau = sum_k r_k x R' (0, 0, f_k), f_k: a quarter of downwash at rotor k";
    info.source = "blade forces in the wake that downwash describes; its defaults, Crazyflie arms";
    info.excitation =
        "logs at the rate of the attitude loop: pass below another vehicle, 0.2 .. 0.6 m, to all sides of it";
    for (Parameter& parameter : info.shape) parameter.grid.clear();
    info.shape.push_back(
        {"arm_m", "from the centre to each of the four rotors, in X", kCrazyflieArm_m, 0.01, 1});
    info.traits = {Family::kNone, Family::kNone, ShownBy::kNothing};
    return info;
  }
  void columns(const Instant& now, const double* shape, Wrench* columns) const override {
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
  bool in_support(const Instant& now, const double* shape) const override {
    return downwash_.in_support(now, shape);
  }
  double reach_m(double dz_m, const double* shape) const override {
    const double reach_m = downwash_.reach_m(dz_m + shape[kArm], shape);
    return reach_m > 0 ? reach_m + shape[kArm] : 0;
  }

 private:
  Downwash downwash_;
  mutable std::vector<Neighbour> at_rotor_;  ///< scratch: the neighbours relative to one rotor
};

}  // namespace

EffectEntry effects::downwash_torque() { return effect_entry<DownwashTorque>(); }

}  // namespace swarmcert::stability
