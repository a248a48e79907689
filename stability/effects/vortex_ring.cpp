/// @file Thrust lost in the vehicle's own wake as it descends: f = -a T exp(-((v_c + v_0) / w)^2 / 2) b3.
#include <cmath>

#include "stability/effects/effect.h"
#include "stability/effects/effect_entry.h"
#include "stability/effects/hint.h"

namespace swarmcert::stability {
namespace {

enum VortexShape { kDescent, kVortexWidth };

double descent_offset(const Instant& now, const double* shape) {
  return (now.b3_W().dot(now.v_W_m_s) + shape[kDescent]) / shape[kVortexWidth];
}

class VortexRing : public Effect {
 public:
  VortexRing()
      : Effect(
            {"vortex_ring",
             "f = -a T exp(-((v_c + v_0) / w)^2 / 2) b3, v_c the velocity along the thrust axis",
             "thrust is lost where the descent is about as fast as the rotor's own induced velocity (vortex "
             "ring state: half to one and a half times it), but not at lower or higher speeds",
             "vortex_ring",
             "straight descents at several speeds up to twice v_0",
             {{"loss", "a: fraction of the thrust lost at descent speed v_0", 0, 0, 0.6}},
             {{"descent_m_s",
               "v_0: descent speed with the largest loss",
               1,
               0.05,
               20,
               {0.3, 0.5, 0.8, 1.2, 2, 4}},
              {"width_m_s", "w", 0.3, 0.02, 10, {0.1, 0.2, 0.5, 1}}}},
            {Family::kNone, Family::kNone, ShownBy::kCurve, SetPoints::kNotNeeded, {"vz", "climb"}}) {}
  void columns(const Instant& now, const double* shape, Wrench* columns) const override {
    const double x = descent_offset(now, shape);
    columns[0] = {-now.thrust_N * std::exp(-x * x / 2) * now.b3_W(), Eigen::Vector3d::Zero()};
  }
  bool in_support(const Instant& now, const double* shape) const override {
    return std::abs(descent_offset(now, shape)) < 2;
  }
  bool start_at(const Hint& hint, Start& start) const override {
    if (!hint.is_vertical()) return false;
    const auto at_m_s = hint.number_of("centre"), width_m_s = hint.first_of({"width", "core"});
    if (at_m_s && width_m_s && *at_m_s < 0) start.thetas.push_back({-*at_m_s, *width_m_s});
    return true;
  }
};

}  // namespace

EffectEntry effects::vortex_ring() { return effect_entry<VortexRing>(); }

}  // namespace swarmcert::stability
