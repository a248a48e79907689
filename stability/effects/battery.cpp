#include "stability/effects/battery.h"

#include <cmath>

namespace swarmcert::stability {

EffectInfo Battery::describe() {
  return {
      "battery",
      "f = k (V - 4.2) T b3",
      "first-order remainder of a thrust map that already has the voltage in it",
      "battery",
      "repeat the same accelerations over more than 0.3 V of discharge; fly a discharged battery first once",
      {{"sensitivity_1_V", "relative thrust per volt", 0, 0, 1}},
      {}};
}

void Battery::columns(const Instant& now, const double*, Wrench* columns) const {
  columns[0] = {(now.battery_V - kFullBattery_V) * now.thrust_N * now.b3_W(), Eigen::Vector3d::Zero()};
}

bool Battery::in_support(const Instant& now, const double*) const {
  return std::abs(now.battery_V - kFullBattery_V) > 0.1;
}

}  // namespace swarmcert::stability
