/// @file The rest-to-rest polynomial over an interval.
#pragma once

#include <algorithm>

#include "nn/base/interval.h"

namespace swarmcert::stability {

/// RestToRest and its third derivative 840 u (1 - 5 u), u = x - x^2, over all x of an interval clamped to [0, 1].
/// Evaluates, in interval arithmetic, the ends and the points where the next derivative vanishes; widened by 1e-13 for
/// the round-off error of RestToRest itself.
struct RestToRestRange {
  Interval s, ds, dds, ddds;

  explicit RestToRestRange(Interval x) {
    const double a = std::clamp(x.lower, 0.0, 1.0);
    const double b = std::clamp(x.upper, 0.0, 1.0);
    s = hull(position(a), position(b));
    ds = hull(speed(a), speed(b));
    dds = hull(acceleration(a), acceleration(b));
    ddds = hull(jerk(a), jerk(b));
    if (a <= 0.5 && b >= 0.5) ds = hull(ds, speed(0.5)), ddds = hull(ddds, jerk(0.5));
    // dds is extreme at u = 1/5, ddds at u = 1/10: enclosures of x = (1 -+ sqrt(1 - 4 u))/2.
    for (const Interval at : {Interval(0.276393202, 0.276393203), Interval(0.723606797, 0.723606798)})
      if (a <= at.upper && b >= at.lower) dds = hull(dds, acceleration(at));
    for (const Interval at : {Interval(0.112701665, 0.112701666), Interval(0.887298334, 0.887298335)})
      if (a <= at.upper && b >= at.lower) ddds = hull(ddds, jerk(at));
    const Interval rounding(-1e-13, 1e-13);
    s += rounding, ds += rounding, dds += rounding, ddds += rounding;
  }

 private:
  static Interval position(Interval x) {
    return x * x * x * x * (Interval(35) + x * (Interval(-84) + x * (Interval(70) - Interval(20) * x)));
  }
  static Interval speed(Interval x) {
    const Interval u = x * (Interval(1) - x);
    return Interval(140) * u * u * u;
  }
  static Interval acceleration(Interval x) {
    const Interval u = x * (Interval(1) - x);
    return Interval(420) * u * u * (Interval(1) - Interval(2) * x);
  }
  static Interval jerk(Interval x) {
    const Interval u = x * (Interval(1) - x);
    return Interval(840) * u * (Interval(1) - Interval(5) * u);
  }
};

}  // namespace swarmcert::stability
