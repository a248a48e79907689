/// @file A line to an anchor, which pulls when taut.
#include <algorithm>

#include "stability/effects/effect.h"
#include "stability/effects/effect_entry.h"

namespace swarmcert::stability {
namespace {

enum TetherShape { kAnchorX, kAnchorY, kAnchorZ, kSlack };

Eigen::Vector3d from_anchor(const Instant& now, const double* shape) {
  return now.p_W_m - Eigen::Vector3d(shape[kAnchorX], shape[kAnchorY], shape[kAnchorZ]);
}

/// f = -k max(0, |p - a| - l) (p - a) / |p - a|, a the anchor and l the slack length.
class Tether : public Effect {
 public:
  Tether()
      : Effect({"tether",
                "f = -k max(0, |p - a| - l) (p - a) / |p - a|",
                "an elastic line, or a cable whose slope grows as it is drawn up",
                "tether",
                "slow flight in all directions from the anchor, up to 1.5 times the distance at which the "
                "line is taut",
                {{"stiffness_N_m", "k", 0, 0, 10}},
                {{"anchor_x_m", "a", 0, -1000, 1000, {}},
                 {"anchor_y_m", "", 0, -1000, 1000, {}},
                 {"anchor_z_m", "", 0, -1000, 1000, {}},
                 {"slack_m", "l: the line's free length", 1, 0, 1000, {}}}}) {}
  void columns(const Instant& now, const double* shape, Wrench* columns) const override {
    const Eigen::Vector3d out_m = from_anchor(now, shape);
    const double length_m = out_m.norm(), taut_m = length_m - shape[kSlack];
    columns[0] = {};
    if (taut_m > 0 && length_m > 0) columns[0].force_W_N = -taut_m / length_m * out_m;
  }
  bool in_support(const Instant& now, const double* shape) const override {
    return from_anchor(now, shape).norm() > shape[kSlack];
  }
};

}  // namespace

EffectEntry effects::tether() { return effect_entry<Tether>(); }

}  // namespace swarmcert::stability
