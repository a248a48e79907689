/// @file A wall at the edge of the room: f = p T exp(-d / b) n.
#include <algorithm>
#include <cmath>

#include "stability/effects/effect.h"
#include "stability/effects/effect_entry.h"

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
              {"decay_m", "b", 0.1, 0.005, 10, {0.05, 0.1, 0.2, 0.4}}}}) {}
  void columns(const Instant& now, const double* shape, Wrench* columns) const override {
    const Eigen::Vector3d into(-std::cos(shape[kBearing]), -std::sin(shape[kBearing]), 0);
    columns[0] = {now.thrust_N * std::exp(-wall_gap_m(now, shape) / shape[kWallDecay]) * into,
                  Eigen::Vector3d::Zero()};
  }
  bool in_support(const Instant& now, const double* shape) const override {
    return wall_gap_m(now, shape) < 2 * shape[kWallDecay];
  }
};

}  // namespace

EffectEntry effects::wall() { return effect_entry<Wall>(); }

}  // namespace swarmcert::stability
