/// @file Thrust error of the map as the battery drains: f = k (V - 4.2 V) T b3.
#include <cmath>

#include "stability/effects/effect.h"
#include "stability/effects/effect_entry.h"

namespace swarmcert::stability {
namespace {

class Battery : public Effect {
 public:
  Battery()
      : Effect(
            {"battery",
             "f = k (V - 4.2) T b3",
             "first-order remainder of a thrust map that already includes the voltage",
             "battery",
             "repeat the same accelerations over more than 0.3 V of discharge; once, begin with a discharged "
             "battery",
             {{"sensitivity_1_V", "relative thrust per volt", 0, 0, 1}},
             {}},
            {Family::kThrustScale,
             Family::kThrustScale,
             ShownBy::kForce,
             SetPoints::kBesideRemainder,
             {"battery"}}) {}
  void columns(const Instant& now, const double*, Wrench* columns) const override {
    columns[0] = {(now.battery_V - kFullBattery_V) * now.thrust_N * now.b3_W(), Eigen::Vector3d::Zero()};
  }
  bool in_support(const Instant& now, const double*) const override {
    return std::abs(now.battery_V - kFullBattery_V) > 0.1;
  }
};

}  // namespace

EffectEntry effects::battery() { return effect_entry<Battery>(); }

}  // namespace swarmcert::stability
