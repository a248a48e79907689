/// @file Thrust gained in horizontal flight: f = a T (1 - exp(-(v_h / v_0)^2)) b3.
#include <cmath>

#include "stability/effects/effect.h"
#include "stability/effects/effect_entry.h"

namespace swarmcert::stability {
namespace {

/// Velocity across the thrust axis.
double speed_across(const Instant& now) {
  return (now.v_W_m_s - now.b3_W() * now.b3_W().dot(now.v_W_m_s)).norm();
}

class TranslationalLift : public Effect {
 public:
  TranslationalLift()
      : Effect(
            {"translational_lift",
             "f = a T (1 - exp(-(v_h / v_0)^2)) b3, v_h the speed across the thrust axis",
             "rotors that move through fresh air need less power for the same thrust (Glauert's momentum "
             "theory of forward flight); the form has its limits: zero at rest and a constant at speed",
             "translational_lift",
             "horizontal flight from rest to twice the speed v_0, at constant height",
             {{"gain", "a: share of the thrust gained at speed", 0, 0, 0.5}},
             {{"speed_m_s", "v_0", 1, 0.05, 20, {0.2, 0.3, 0.4, 0.6, 0.8, 1.2, 2, 4}}}},
            {Family::kNone, Family::kNone, ShownBy::kCurve, SetPoints::kNotNeeded, {"speed", "airspeed"}}) {}
  void columns(const Instant& now, const double* shape, Wrench* columns) const override {
    const double x = speed_across(now) / shape[0];
    columns[0] = {-now.thrust_N * std::expm1(-x * x) * now.b3_W(), Eigen::Vector3d::Zero()};
  }
  bool in_support(const Instant& now, const double* shape) const override {
    return speed_across(now) > 0.5 * shape[0];
  }
};

}  // namespace

EffectEntry effects::translational_lift() { return effect_entry<TranslationalLift>(); }

}  // namespace swarmcert::stability
