/// @file Thrust error of the map as the battery drains: f = k (V - V_0) T b3.
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
             "f = k (V - V_0) T b3, V_0 the voltage of the full pack",
             "first-order remainder of a thrust map that already includes the voltage",
             "battery",
             "repeat the same accelerations over more than 0.3 V of discharge; once, begin with a discharged "
             "battery",
             {{"sensitivity_1_V", "relative thrust per volt", 0, 0, 4.5, {}, Unit::kPerBattery}},
             {{"full_V", "V_0: 4.2 V for each cell in series", kFullBattery_V, 1, 100}}},
            {Family::kThrustScale,
             Family::kThrustScale,
             ShownBy::kForce,
             SetPoints::kBesideRemainder,
             {"battery"}}) {}
  void columns(const Instant& now, const double* shape, Wrench* columns) const override {
    columns[0] = {(now.battery_V - shape[0]) * now.thrust_N * now.b3_W(), Eigen::Vector3d::Zero()};
  }
  bool in_support(const Instant& now, const double* shape) const override {
    constexpr double kClear = 0.025;
    return std::abs(now.battery_V / shape[0] - 1) > kClear;
  }
  std::vector<std::vector<double>> grid(const FlightRange& range) const override {
    // With another reference, part of the effect would be a constant fraction of the thrust.
    return {{range.full_battery_V}};
  }
};

}  // namespace

EffectEntry effects::battery() { return effect_entry<Battery>(); }

}  // namespace swarmcert::stability
