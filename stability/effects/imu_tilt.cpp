/// @file An inertial unit that is tilted relative to the rotors: the log's attitude is that of the unit.
#include "stability/effects/effect.h"
#include "stability/effects/effect_entry.h"

namespace swarmcert::stability {
namespace {

/// f = T R (t x e3), t = (tilt_x, tilt_y, 0): the rotors push along R (e3 + t x e3), to first order in t. In simulation
/// the attitude is that of the inertial unit, so it is the rotors that are tilted.
class ImuTilt : public Effect {
 public:
  ImuTilt()
      : Effect(
            {"imu_tilt",
             "f = T R (t x e3), t = (tilt_x, tilt_y, 0)",
             "a board that is not parallel to the rotors; 1 degree gives 1.7 % of the weight to the side",
             "IMU tilt / IMU bias",
             "yaw through more than 90 degrees: a wind keeps its direction, a tilt turns with the vehicle",
             {{"tilt_x_rad", "tilt of the rotors relative to the inertial unit, about body x", 0, -0.3, 0.3},
              {"tilt_y_rad", "about body y", 0, -0.3, 0.3}},
             {}},
            {Family::kNone,
             Family::kNone,
             ShownBy::kCurve,
             SetPoints::kNotNeeded,
             {"body_constant"},
             Place::kLog}) {}
  void columns(const Instant& now, const double*, Wrench* columns) const override {
    columns[0] = {-now.thrust_N * now.R_WB.col(1), Eigen::Vector3d::Zero()};
    columns[1] = {now.thrust_N * now.R_WB.col(0), Eigen::Vector3d::Zero()};
  }
  bool start_at(const Hint&, Start&) const override { return true; }
};

}  // namespace

EffectEntry effects::imu_tilt() { return effect_entry<ImuTilt>(); }

}  // namespace swarmcert::stability
