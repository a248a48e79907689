/// @file Integrals and suprema of functions that are piecewise polynomials up to a bounded error. Not for users.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "nn/base/interval.h"

namespace swarmcert::stability {

inline constexpr int kLocalTerms = 18;
/// Maximum number of times a segment is halved.
inline constexpr int kLocalDepth = 30;

/// Taylor coefficients of one output along a trajectory from a point, with a remainder and an error ball.
struct LocalPolynomial {
  std::array<Interval, kLocalTerms> c;
  double remainder = 0;  ///< times s^kLocalTerms
  double error = 0;      ///< of the point, as seen in this output

  /// Returns the error of the polynomial, as an interval that holds anywhere up to `s`.
  Interval slack(double s) const {
    const double r = up(nth_power(Interval(s), kLocalTerms).upper * remainder);
    const double total = up(r + error);
    return {-total, total};
  }
  Interval polynomial(double s) const {
    Interval total;
    for (int k = kLocalTerms; k-- > 0;) total = total * Interval(s) + c[static_cast<std::size_t>(k)];
    return total;
  }
  Interval at(double s) const { return polynomial(s) + slack(s); }

  /// Returns the range on [a, b]: the value at the midpoint plus the slope over the segment (mean value form).
  Interval range(double a, double b) const {
    const double middle = a + (b - a) / 2;
    const Interval s(a, b);
    Interval slope;
    for (int k = kLocalTerms - 1; k-- > 0;) {
      slope = slope * s + c[static_cast<std::size_t>(k) + 1] * Interval(static_cast<double>(k + 1));
    }
    return polynomial(middle) + slope * (s - Interval(middle)) + slack(b);
  }
};

/// Integrates |f| in chronological order. While f keeps its sign, the integral is the difference of an antiderivative F
/// between the ends of the whole run, so the enclosure widths of F are incurred once per sign change and not once per
/// segment.
class AbsoluteIntegral {
 public:
  void add(const LocalPolynomial& f, const LocalPolynomial& F, double a, double b, int depth) {
    const Interval range = f.range(a, b);
    const int sign = range.lower >= 0 ? 1 : range.upper <= 0 ? -1 : 0;
    if (sign != 0) {
      if (sign != sign_) {
        close();
        sign_ = sign;
        start_ = F.at(a);
      }
      end_ = F.at(b);
      return;
    }
    const double most = up(up(b - a) * range.mag());
    // No subdivision can determine the sign of a value smaller than its own error.
    if (depth == 0 || most < 1e-19 || 8 * f.slack(b).upper > range.mag()) {
      close();
      total_ += Interval(0, most);
      return;
    }
    const double middle = a + (b - a) / 2;
    add(f, F, a, middle, depth - 1);
    add(f, F, middle, b, depth - 1);
  }

  Interval finish() {
    close();
    return total_;
  }

 private:
  void close() {
    if (sign_ != 0) {
      const Interval part = sign_ > 0 ? end_ - start_ : start_ - end_;
      total_ += Interval(std::max(0.0, part.lower), std::max(0.0, part.upper));
    }
    sign_ = 0;
  }

  Interval total_, start_, end_;
  int sign_ = 0;
};

/// Updates `lower` and best to enclose the supremum of |f| over all segments seen so far.
inline void raise_supremum(const LocalPolynomial& f, const LocalPolynomial& slope, double a, double b,
                           int depth, double& lower, Interval& best) {
  lower = std::max({lower, abs(f.at(a)).lower, abs(f.at(b)).lower});
  best.lower = std::max(best.lower, lower);
  const Interval turn = slope.range(a, b);
  double most;
  if (turn.lower >= 0 || turn.upper <= 0) {
    most = std::max(f.at(a).mag(), f.at(b).mag());  // monotonic
  } else {
    most = f.range(a, b).mag();
    if (most <= best.upper) return;
    if (depth > 0 && most > lower * (1 + 1e-15) && 8 * slope.slack(b).upper < turn.mag()) {
      const double middle = a + (b - a) / 2;
      raise_supremum(f, slope, a, middle, depth - 1, lower, best);
      raise_supremum(f, slope, middle, b, depth - 1, lower, best);
      return;
    }
  }
  best.upper = std::max(best.upper, most);
}

}  // namespace swarmcert::stability
