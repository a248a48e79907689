/// @file Power series in time, truncated, whose coefficients are affine forms.
#pragma once

#include <utility>

#include "stability/reach/affine_form.h"

namespace swarmcert::stability {

/// x(t) = c[0] + c[1] t + c[2] t^2 + ..., up to the order that the operands know; a constant has only c[0].
///
/// Coefficient k of every operation encloses the k-th Taylor coefficient and depends only on those up to k of the
/// operands: the recurrences of automatic differentiation (Moore 1966).
struct TimeSeries {
  AffineVector c;

  TimeSeries(AffineForm constant) : c{std::move(constant)} {}  // NOLINT: a constant is a series
  TimeSeries(double constant) : c{constant} {}                 // NOLINT
  TimeSeries(Interval constant) : c{constant} {}               // NOLINT
  explicit TimeSeries(AffineVector coefficients) : c(std::move(coefficients)) {}
  /// Returns coefficient k, 0 beyond the last.
  AffineForm operator[](std::size_t k) const { return k < c.size() ? c[k] : AffineForm(); }
  /// Returns x(t).
  AffineForm at(Interval t) const;
};

TimeSeries operator+(const TimeSeries& a, const TimeSeries& b);
TimeSeries operator-(const TimeSeries& a);
TimeSeries operator-(const TimeSeries& a, const TimeSeries& b);
TimeSeries operator*(const TimeSeries& a, const TimeSeries& b);
TimeSeries operator/(const TimeSeries& a, const TimeSeries& b);
/// Returns sin x and cos x.
std::pair<TimeSeries, TimeSeries> sin_and_cos(const TimeSeries& x);

}  // namespace swarmcert::stability
