/// @file Sine and cosine with the same bits on every platform; C libraries differ in the last place.
#pragma once

#include <limits>

#include "controller/scalar.h"

namespace swarmcert::controller {

template <typename Scalar>
struct SineCosine {
  Scalar sine, cosine;
};

/// Largest argument of sin_cos(), in radians: sixteen turns.
inline constexpr int kLargestAngle_rad = 100;

/// Returns sin and cos of `angle_rad`; both are NaN if |angle| > kLargestAngle_rad or the angle is NaN.
///
/// The angle is reduced modulo pi/2, with pi/2 split into three parts, the first two of which have so few bits that
/// their products with the number of quarter turns are exact (Cody and Waite 1980). A Taylor polynomial on [-pi/4,
/// pi/4] follows, whose remainder is below 3e-14. The error is at most 1.2e-7 for float and 1e-13 for double; a test
/// measures it against long double.
template <typename Scalar>
inline SineCosine<Scalar> sin_cos(Scalar angle_rad) {
  const Scalar limit(kLargestAngle_rad);
  if (!(angle_rad >= -limit && angle_rad <= limit)) {
    const Scalar undefined = std::numeric_limits<Scalar>::quiet_NaN();
    return {undefined, undefined};
  }
  const Scalar quarters = product(angle_rad, Scalar(0.636619772367581343));
  const int turns = static_cast<int>(quarters < Scalar(0) ? quarters - Scalar(0.5) : quarters + Scalar(0.5));
  const Scalar k = static_cast<Scalar>(turns);
  Scalar r = angle_rad - product(k, Scalar(1.5703125));
  r = r - product(k, Scalar(4.8375129699707031250e-4));
  r = r - product(k, Scalar(7.54978995489188216e-8));

  const Scalar q = product(r, r);
  const Scalar odd[] = {Scalar(1.0 / 6227020800.0), Scalar(-1.0 / 39916800.0), Scalar(1.0 / 362880.0),
                        Scalar(-1.0 / 5040.0),      Scalar(1.0 / 120.0),       Scalar(-1.0 / 6.0)};
  Scalar s = odd[0];
  for (int i = 1; i < 6; ++i) s = odd[i] + product(q, s);
  const Scalar sine = r + product(r, product(q, s));
  const Scalar even[] = {Scalar(-1.0 / 87178291200.0), Scalar(1.0 / 479001600.0), Scalar(-1.0 / 3628800.0),
                         Scalar(1.0 / 40320.0),        Scalar(-1.0 / 720.0),      Scalar(1.0 / 24.0)};
  Scalar c = even[0];
  for (int i = 1; i < 6; ++i) c = even[i] + product(q, c);
  const Scalar cosine = (Scalar(1) - product(Scalar(0.5), q)) + product(product(q, q), c);

  switch (turns & 3) {
    case 0:
      return {sine, cosine};
    case 1:
      return {cosine, -sine};
    case 2:
      return {-sine, -cosine};
    default:
      return {-cosine, sine};
  }
}

}  // namespace swarmcert::controller
