/// @file Thrust deficit because the supply voltage sags under load: f = -s T ((T / W)^(3/2) - 1) b3.
#include <algorithm>
#include <cmath>

#include "stability/effects/effect.h"
#include "stability/effects/effect_entry.h"

namespace swarmcert::stability {
namespace {

class VoltageSag : public Effect {
 public:
  VoltageSag()
      : Effect(
            {"voltage_sag",
             "f = -s T ((T / W)^(3/2) - 1) b3",
             "the power of a rotor at rest in air grows with T^(3/2) (momentum theory), and the supply "
             "voltage falls in proportion to the power; W is the weight: hovering is part of the thrust map",
             "voltage_sag",
             "thrust from half to one and a half times the weight, with the battery's voltage logged slowly "
             "or "
             "not at all",
             {{"sag", "fraction of the thrust lost per multiple of the hovering power", 0, 0, 0.5}},
             {}},
            {Family::kNone, Family::kNone, ShownBy::kCurve, SetPoints::kAlways, thrust_variables()}) {}
  void columns(const Instant& now, const double*, Wrench* columns) const override {
    const double load = std::max(now.thrust_N, 0.0) / (now.mass_kg * kGravity_m_s2);
    columns[0] = {-now.thrust_N * (load * std::sqrt(load) - 1) * now.b3_W(), Eigen::Vector3d::Zero()};
  }
  bool in_support(const Instant& now, const double*) const override {
    constexpr double kClear = 0.1;
    return std::abs(now.thrust_N / (now.mass_kg * kGravity_m_s2) - 1) > kClear;
  }
};

}  // namespace

EffectEntry effects::voltage_sag() { return effect_entry<VoltageSag>(); }

}  // namespace swarmcert::stability
