/// @file Thrust deficit above a knee, because propellers saturate: f = -c max(0, T - k W) b3.
#include <algorithm>

#include "stability/effects/effect.h"
#include "stability/effects/effect_entry.h"
#include "stability/effects/hint.h"

namespace swarmcert::stability {
namespace {

EffectTraits thrust_saturation_traits() {
  EffectTraits traits;
  traits.shown_by = ShownBy::kCurve;
  traits.set_points = SetPoints::kAlways;
  traits.variables = thrust_variables();
  // It makes a vehicle tumble close to hover, and setpoints hardly reach beyond the knee.
  traits.hides_its_curve = true;
  return traits;
}

class ThrustSaturation : public Effect {
 public:
  ThrustSaturation()
      : Effect(
            {"thrust_saturation",
             "f = -c max(0, T - k W) b3",
             "propellers and motors at their limit: above the knee, the thrust is only a fraction of that of "
             "the map; W is the weight",
             "thrust_saturation",
             "climbs and turns that need much more thrust than hovering",
             {{"loss", "fraction of the thrust above the knee that is lost", 0, 0, 1}},
             {{"knee_weights",
               "k: thrust over weight above which thrust is lost; at least 1, that of hovering",
               1.3,
               1,
               5,
               {1.02, 1.05, 1.1, 1.15, 1.2, 1.3, 1.4, 1.6}}}},
            thrust_saturation_traits()) {}
  void columns(const Instant& now, const double* shape, Wrench* columns) const override {
    const double over_N = now.thrust_N - shape[0] * now.mass_kg * kGravity_m_s2;
    columns[0] = {-std::max(over_N, 0.0) * now.b3_W(), Eigen::Vector3d::Zero()};
  }
  bool in_support(const Instant& now, const double* shape) const override {
    return now.thrust_N > shape[0] * now.mass_kg * kGravity_m_s2;
  }
  bool start_at(const Hint& hint, Start& start) const override {
    if (!hint.is_vertical()) return false;
    // Also at the thrust above which the formula's force acts, which may be close to hover.
    const auto from_N = hint.number_of("from");
    if (hint.variable == "thrust" && hint.form == "above" && from_N)
      start.thetas.push_back({std::max(*from_N / hint.weight_N, start.info.shape[0].lower)});
    return true;
  }
};

}  // namespace

EffectEntry effects::thrust_saturation() { return effect_entry<ThrustSaturation>(); }

}  // namespace swarmcert::stability
