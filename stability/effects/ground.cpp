/// @file Ground effect: f = a T exp(-(z - z0) / b) b3.
#include <algorithm>
#include <cmath>

#include "stability/effects/effect.h"
#include "stability/effects/effect_entry.h"

namespace swarmcert::stability {
namespace {

enum GroundShape { kGroundDecay, kGroundReference };

EffectTraits ground_traits() {
  EffectTraits traits;
  traits.variables = {"z"};
  traits.seen_below_arms = 9;  // nothing is measurable higher up
  return traits;
}

class Ground : public Effect {
 public:
  Ground()
      : Effect({"ground",
                "f = a T exp(-(z - z0) / b) b3",
                "fits published flights better than Cheeseman and Bennett 1955 with the radius of one rotor, "
                "and equals it if amplitude, radius and height are free",
                "ground",
                "at least a fifth of the time below two rotor radii above the height on the ground",
                {{"amplitude", "relative thrust gained at the height z0", 0, 0, 1}},
                {{"decay_m",
                  "b",
                  0.0268,
                  0.1,
                  11,
                  {0.015, 0.02, 0.027, 0.035, 0.05, 0.07, 0.1, 0.14},
                  Unit::kArm},
                 {"height_reference_m", "z0: about the height at which the vehicle stands", 0.06, 0, 1}}},
               ground_traits()) {}
  void columns(const Instant& now, const double* shape, Wrench* columns) const override {
    const double height_m = std::max(now.p_W_m.z(), 0.0) - shape[kGroundReference];
    columns[0] = {now.thrust_N * std::exp(-height_m / shape[kGroundDecay]) * now.b3_W(),
                  Eigen::Vector3d::Zero()};
  }
  bool in_support(const Instant& now, const double* shape) const override {
    return now.p_W_m.z() < shape[kGroundReference] + 2 * shape[kGroundDecay];
  }
};

}  // namespace

EffectEntry effects::ground() { return effect_entry<Ground>(); }

}  // namespace swarmcert::stability
