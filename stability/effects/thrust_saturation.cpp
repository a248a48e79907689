/// @file Thrust deficit above a knee, because propellers saturate: f = -c max(0, T - k W) b3.
#include <algorithm>

#include "stability/effects/effect.h"
#include "stability/effects/effect_entry.h"

namespace swarmcert::stability {
namespace {

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
               {1.02, 1.05, 1.1, 1.15, 1.2, 1.3, 1.4, 1.6}}}}) {}
  void columns(const Instant& now, const double* shape, Wrench* columns) const override {
    const double over_N = now.thrust_N - shape[0] * now.mass_kg * kGravity_m_s2;
    columns[0] = {-std::max(over_N, 0.0) * now.b3_W(), Eigen::Vector3d::Zero()};
  }
  bool in_support(const Instant& now, const double* shape) const override {
    return now.thrust_N > shape[0] * now.mass_kg * kGravity_m_s2;
  }
};

}  // namespace

EffectEntry effects::thrust_saturation() { return effect_entry<ThrustSaturation>(); }

}  // namespace swarmcert::stability
