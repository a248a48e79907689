/// @file A constant force in the world: steady wind, a tilted thrust axis, a biased accelerometer.
#include "stability/effects/effect.h"
#include "stability/effects/effect_entry.h"

namespace swarmcert::stability {
namespace {

class ConstantForce : public Effect {
 public:
  ConstantForce()
      : Effect(
            {"constant_force",
             "f = (f_x, f_y, f_z) in the world",
             "common effect of wind times linear drag, a tilted thrust axis and a biased accelerometer",
             "wind / tilt / IMU bias",
             "yaw through more than 90 degrees (world against body), tilt changes (bias against thrust axis)",
             {{"force_x_N", "world x", 0, -1, 1, {}, Unit::kWeight},
              {"force_y_N", "world y", 0, -1, 1, {}, Unit::kWeight},
              {"force_z_N", "world z", 0, -1, 1, {}, Unit::kWeight}},
             {}},
            traits()) {}
  static EffectTraits traits() {
    EffectTraits traits;
    traits.family = Family::kPush;
    traits.variables = {"heading"};  // what is constant in the body turns in the world
    return traits;
  }
  void columns(const Instant&, const double*, Wrench* columns) const override {
    for (int axis = 0; axis < 3; ++axis)
      columns[axis] = {Eigen::Vector3d::Unit(axis), Eigen::Vector3d::Zero()};
  }
};

}  // namespace

EffectEntry effects::constant_force() { return effect_entry<ConstantForce>(); }

}  // namespace swarmcert::stability
