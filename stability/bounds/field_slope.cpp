#include "stability/bounds/field_slope.h"

#include <cmath>
#include <queue>

#include "nn/base/doubles.h"
#include "stability/bounds/enclosures/interval_functions.h"
#include "stability/effects/wake_shape.h"

namespace swarmcert::stability {
namespace {

constexpr double kFarSpreads = 7;
constexpr double kGap = 1e-3;
constexpr int kMostBoxes = 6000;

enum Slope { kTotal, kAcross, kAlong };

/// Returns 1/x of an interval of positive numbers, which may be unbounded.
Interval inverse(Interval x) { return {std::isinf(x.upper) ? 0 : down(1 / x.upper), up(1 / x.lower)}; }

/// q = r / spread(h), and z, on one side of kWakeNearest_m.
struct Box {
  Interval q, z;
  double bound = 0;
  bool operator<(const Box& other) const { return bound < other.bound; }
};

class Slopes {
 public:
  Slopes(const WakeField& field, Slope which) : field_(field), which_(which) {
    at_nearest_ = pow(Interval(kWakeReference_m) / Interval(kWakeNearest_m), field.decay);
  }

  Interval operator()(Interval q, Interval z) const {
    // Beyond kFarSpreads, q^k exp(-q^2/2) with k <= 2 decreases, so its values lie between 0 and the value at the near
    // end.
    const bool is_far = std::isinf(q.upper);
    const Interval nearest(q.lower);
    const Interval exponent = square(is_far ? nearest : q) / Interval(2);
    Interval E = exp(-exponent);
    Interval qE = (is_far ? nearest : q) * E;
    Interval qqE = square(is_far ? nearest : q) * E;
    if (is_far) E.lower = qE.lower = qqE.lower = 0;
    Interval along;
    Interval across;
    if (z.upper <= kWakeNearest_m) {
      const Interval spread =
          Interval(field_.spread_m) + Interval(field_.spread_slope) * Interval(kWakeNearest_m);
      const Interval x =
          (z - Interval(kWakeTouching_m)) / (Interval(kWakeNearest_m) - Interval(kWakeTouching_m));
      const Interval fade = field_.fades ? smooth_step(x) : Interval(1);
      const Interval rise = field_.fades ? Interval(6) * x * (Interval(1) - x) /
                                               (Interval(kWakeNearest_m) - Interval(kWakeTouching_m))
                                         : Interval(0);
      along = at_nearest_ * rise * E;
      across = at_nearest_ * fade * qE / spread;
    } else {
      const Interval closeness = inverse(z);
      const Interval strength = {std::isinf(z.upper) ? (field_.decay > 0 ? 0 : 1) : power(z.upper).lower,
                                 power(z.lower).upper};
      const Interval spread = {down(field_.spread_m + down(field_.spread_slope * z.lower)),
                               std::isinf(z.upper) && field_.spread_slope == 0
                                   ? up(field_.spread_m)
                                   : up(field_.spread_m + up(field_.spread_slope * z.upper))};
      const Interval narrowness = inverse(spread);
      along = strength *
              (Interval(field_.spread_slope) * narrowness * qqE - Interval(field_.decay) * closeness * E);
      across = strength * narrowness * qE;
    }
    if (which_ == kAcross) return abs(across);
    if (which_ == kAlong) return abs(along);
    return sqrt(square(across) + square(along));
  }

 private:
  Interval power(double z) const { return pow(Interval(kWakeReference_m) / Interval(z), field_.decay); }
  /// x^2 (3 - 2x), which increases on [0, 1].
  static Interval smooth_step(Interval x) {
    const auto at = [](double t) {
      return Interval(t) * Interval(t) * (Interval(3) - Interval(2) * Interval(t));
    };
    return {at(std::max(x.lower, 0.0)).lower, at(std::min(x.upper, 1.0)).upper};
  }

  const WakeField& field_;
  Slope which_;
  Interval at_nearest_;
};

Interval supremum(const WakeField& field, Slope which, double from_m, double to_m) {
  const Slopes slope(field, which);
  std::priority_queue<Box> open;
  double reached = 0;
  const auto add = [&](Interval q, Interval z) {
    open.push({q, z, slope(q, z).upper});
    const double middle_q = std::isinf(q.upper) ? q.lower : q.lower + (q.upper - q.lower) / 2;
    const double middle_z = std::isinf(z.upper) ? z.lower : z.lower + (z.upper - z.lower) / 2;
    for (const double at : {z.lower, middle_z})
      reached = std::max(reached, slope(Interval(middle_q), Interval(at)).lower);
  };
  for (const Interval q : {Interval(0, kFarSpreads), Interval(kFarSpreads, kInfinity)}) {
    if (from_m < kWakeNearest_m) add(q, {from_m, std::min(to_m, kWakeNearest_m)});
    if (to_m > kWakeNearest_m) add(q, {std::max(from_m, kWakeNearest_m), to_m});
  }
  for (int i = 0; i < kMostBoxes && open.top().bound > reached * (1 + kGap); ++i) {
    const Box box = open.top();
    open.pop();
    const bool halves_z = std::isinf(box.z.upper) || std::isinf(box.q.upper) ||
                          (box.z.upper - box.z.lower) / box.z.lower > (box.q.upper - box.q.lower);
    if (halves_z) {
      const double middle =
          std::isinf(box.z.upper) ? 2 * box.z.lower : box.z.lower + (box.z.upper - box.z.lower) / 2;
      if (!(middle > box.z.lower && middle < box.z.upper)) {
        open.push(box);
        break;
      }
      add(box.q, {box.z.lower, middle});
      add(box.q, {middle, box.z.upper});
    } else {
      const double middle = box.q.lower + (box.q.upper - box.q.lower) / 2;
      add({box.q.lower, middle}, box.z);
      add({middle, box.q.upper}, box.z);
    }
  }
  return {reached, open.top().bound};
}

}  // namespace

FieldSlopes field_slopes(const WakeField& field, double least_gap_m, double largest_gap_m) {
  FieldSlopes result;
  if (largest_gap_m <= kWakeTouching_m) return result;
  const double from_m = std::max(least_gap_m, kWakeTouching_m);
  // Directly below, the field increases up to kWakeNearest_m and decreases beyond.
  const double strongest_m = std::max(from_m, kWakeNearest_m);
  result.value = pow(Interval(kWakeReference_m) / Interval(strongest_m), field.decay);
  if (largest_gap_m < kWakeNearest_m && field.fades) {
    const Interval x = (Interval(largest_gap_m) - Interval(kWakeTouching_m)) /
                       (Interval(kWakeNearest_m) - Interval(kWakeTouching_m));
    result.value = result.value * x * x * (Interval(3) - Interval(2) * x);
  }
  if (!field.fades && least_gap_m <= kWakeTouching_m) {
    result.total = result.across = result.along = {0, kInfinity};
    return result;
  }
  result.total = supremum(field, kTotal, from_m, largest_gap_m);
  result.across = supremum(field, kAcross, from_m, largest_gap_m);
  result.along = supremum(field, kAlong, from_m, largest_gap_m);
  return result;
}

}  // namespace swarmcert::stability
