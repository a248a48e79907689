/// @file A wall at the edge of the room: f = p T exp(-d / b) n.
#include <algorithm>
#include <cmath>

#include "nn/base/pi.h"
#include "stability/effects/effect.h"
#include "stability/effects/effect_entry.h"
#include "stability/effects/hint.h"

namespace swarmcert::stability {
namespace {

enum WallShape { kBearing, kWallPlace, kWallDecay };

double wall_gap_m(const Instant& now, const double* shape) {
  const double along = std::cos(shape[kBearing]) * now.p_W_m.x() + std::sin(shape[kBearing]) * now.p_W_m.y();
  return std::max(shape[kWallPlace] - along, 0.0);
}

class Wall : public Effect {
 public:
  Wall()
      : Effect(
            {"wall",
             "f = p T exp(-d / b) n, n from the wall into the room, d the distance from the wall",
             "a wall repels or attracts rotors within a few of their radii; the exponential form is that of "
             "the ground",
             "wall",
             "slow flight along the wall at several distances down to two rotor radii",
             {{"push", "p: force at the wall over the thrust, negative if it attracts", 0, -1, 1}},
             {{"bearing_rad", "direction from the origin to the wall, from x towards y", 0, -3.2, 3.2, {}},
              {"place_m", "the wall's distance from the origin along the bearing", 1, -1000, 1000, {}},
              {"decay_m", "b", 0.1, 0.1, 200, {0.05, 0.1, 0.2, 0.4}, Unit::kArm}}},
            {Family::kNone, Family::kNone, ShownBy::kCurve, SetPoints::kNotNeeded, {"x", "y"}}) {}
  void columns(const Instant& now, const double* shape, Wrench* columns) const override {
    const Eigen::Vector3d into(-std::cos(shape[kBearing]), -std::sin(shape[kBearing]), 0);
    columns[0] = {now.thrust_N * std::exp(-wall_gap_m(now, shape) / shape[kWallDecay]) * into,
                  Eigen::Vector3d::Zero()};
  }
  bool in_support(const Instant& now, const double* shape) const override {
    return wall_gap_m(now, shape) < 2 * shape[kWallDecay];
  }
  bool start_at(const Hint& hint, Start& start) const override {
    // A force along x that is concentrated at one end of the flown range of x, and likewise for y. Nothing flies beyond
    // a wall: it is at that end, or where the formula has its position.
    const bool is_x = hint.variable == "x";
    const auto range = hint.range_of_place();
    if (!hint.acts_along({is_x ? "force_x_N" : "force_y_N"}) || !range) return false;
    const bool is_above = range->at_m > 0.5 * (range->lower_m + range->upper_m);
    const double end_m = is_above ? range->upper_m : range->lower_m;
    const double bearing = is_x ? (is_above ? 0 : kPi) : (is_above ? 0.5 : -0.5) * kPi;
    start.thetas.clear();
    for (const double place_m : {end_m, range->at_m}) {
      for (const double share : {0.06, 0.1, 0.15, 0.25})
        start.thetas.push_back({bearing, is_above ? place_m : -place_m, share * range->span_m()});
      if (range->at_m == end_m) break;
    }
    start.free_shape({"decay_m"});
    return true;
  }
};

}  // namespace

EffectEntry effects::wall() { return effect_entry<Wall>(); }

}  // namespace swarmcert::stability
