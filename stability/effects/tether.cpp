/// @file A line to an anchor, which pulls when taut.
#include <algorithm>

#include "stability/effects/effect.h"
#include "stability/effects/effect_entry.h"
#include "stability/effects/hint.h"

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
      : Effect(
            {"tether",
             "f = -k max(0, |p - a| - l) (p - a) / |p - a|",
             "an elastic line, or a cable whose slope grows as it is drawn up",
             "tether",
             "slow flight in all directions from the anchor, up to 1.5 times the distance at which the "
             "line is taut",
             {{"stiffness_N_m", "k", 0, 0, 2, {}, Unit::kWeightPerArm}},
             {{"anchor_x_m", "a", 0, -1000, 1000, {}},
              {"anchor_y_m", "", 0, -1000, 1000, {}},
              {"anchor_z_m", "", 0, -1000, 1000, {}},
              {"slack_m", "l: the line's free length", 1, 0, 1000, {}}}},
            {Family::kNone, Family::kNone, ShownBy::kCurve, SetPoints::kNotNeeded, {"x", "y", "z", "xy"}}) {}
  void columns(const Instant& now, const double* shape, Wrench* columns) const override {
    const Eigen::Vector3d out_m = from_anchor(now, shape);
    const double length_m = out_m.norm(), taut_m = length_m - shape[kSlack];
    columns[0] = {};
    if (taut_m > 0 && length_m > 0) columns[0].force_W_N = -taut_m / length_m * out_m;
  }
  bool in_support(const Instant& now, const double* shape) const override {
    return from_anchor(now, shape).norm() > shape[kSlack];
  }
  bool start_at(const Hint& hint, Start& start) const override {
    // Anchored below the middle of the flown range; the fit moves the anchor.
    const auto range = hint.range_of_place();
    const double middle_m = range ? 0.5 * (range->lower_m + range->upper_m) : 0;
    const double x_m = hint.number_of("x_centre").value_or(hint.variable == "x" ? middle_m : 0);
    const double y_m = hint.number_of("y_centre").value_or(hint.variable == "y" ? middle_m : 0);
    start.thetas.clear();
    for (const double z_m : {0.0, 0.8}) {
      for (const double slack_m : {0.2, 0.4, 0.6, 0.9, 1.2}) start.thetas.push_back({x_m, y_m, z_m, slack_m});
    }
    start.free_shape({"anchor_x_m", "anchor_y_m", "anchor_z_m", "slack_m"});
    return true;
  }
};

}  // namespace

EffectEntry effects::tether() { return effect_entry<Tether>(); }

}  // namespace swarmcert::stability
