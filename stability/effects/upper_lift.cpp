/// @file Lift on a vehicle that flies above others, caused by the inflow of their rotors.
#include <algorithm>
#include <cmath>

#include "stability/effects/effect.h"
#include "stability/effects/effect_entry.h"
#include "stability/effects/wake_shape.h"

namespace swarmcert::stability {
namespace {

enum UpperLiftShape { kSpread, kExponent };

/// Lift per newton of amplitude from one neighbour; 0 unless it is below.
double lift(const Neighbour& neighbour, const double* shape) {
  const double below_m = -neighbour.dp_W_m.z();
  const double r2 = neighbour.dp_W_m.head<2>().squaredNorm();
  const double s2 = shape[kSpread] * shape[kSpread];
  if (below_m <= kWakeTouching_m || r2 > kWakeReachInSpreads * kWakeReachInSpreads * s2) return 0;
  return std::pow(kWakeReference_m / std::max(below_m, kWakeNearest_m), shape[kExponent]) *
         std::exp(-r2 / (2 * s2));
}

class UpperLift : public Effect {
 public:
  UpperLift()
      : Effect(
            {"upper_lift",
             "f_z = A sum_j (0.3 / -dz_j)^n exp(-r_j^2 / (2 s^2)), over neighbours below",
             "maps of published flights: +0.15 gf (small) and +1.9 gf (large) at 0.3 .. 0.6 m above another",
             "upper_lift",
             "stay 0.2 .. 0.6 m above another vehicle, and pass over it",
             {{"amplitude_N", "lift 0.3 m straight above a neighbour", 0, 0, 0.3, {}, Unit::kWeight}},
             {{"spread_m", "s", 0.1, 0.02, 0.5, {0.06, 0.1, 0.15}}, {"decay_exponent", "n", 0.5, 0, 3}},
             false,
             true}) {}
  void columns(const Instant& now, const double* shape, Wrench* columns) const override {
    double sum = 0;
    for (int j = 0; j < now.num_neighbours; ++j) sum += lift(now.neighbours[j], shape);
    columns[0] = {Eigen::Vector3d(0, 0, sum), Eigen::Vector3d::Zero()};
  }
  bool in_support(const Instant& now, const double* shape) const override {
    for (int j = 0; j < now.num_neighbours; ++j) {
      const Eigen::Vector3d& dp = now.neighbours[j].dp_W_m;
      if (dp.z() < -kWakeTouching_m && dp.z() > -0.8 && dp.head<2>().norm() < 2 * shape[kSpread]) return true;
    }
    return false;
  }
  double reach_m(double dz_m, const double* shape) const override {
    return dz_m < -kWakeTouching_m ? kWakeReachInSpreads * shape[kSpread] : 0;
  }
};

}  // namespace

EffectEntry effects::upper_lift() { return effect_entry<UpperLift>(); }

}  // namespace swarmcert::stability
