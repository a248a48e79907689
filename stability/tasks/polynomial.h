/// @file The rest-to-rest polynomial that flight tasks move along.
#pragma once

#include <algorithm>

namespace swarmcert::stability {

/// s(x) = 35 x^4 - 84 x^5 + 70 x^6 - 20 x^7 and its derivatives: from 0 to 1 with zero velocity, acceleration and jerk
/// at both ends; peak speed 2.1875 in the middle. x is clamped to [0, 1].
struct RestToRest {
  double s, ds, dds;

  explicit RestToRest(double x) {
    x = std::clamp(x, 0.0, 1.0);
    const double y = 1 - x;
    s = x * x * x * x * (35 + x * (-84 + x * (70 - 20 * x)));
    ds = 140 * x * x * x * y * y * y;
    dds = 420 * x * x * y * y * (1 - 2 * x);
  }
};

}  // namespace swarmcert::stability
