/// @file Affine arithmetic: sets of numbers that remember what they depend on, with outward rounding.
#pragma once

#include <vector>

#include "nn/base/interval.h"

namespace swarmcert::stability {

/// The numbers c + a_0 e_0 + a_1 e_1 + ... + r, |r| <= radius, for symbols e_k anywhere in [-1, 1].
///
/// All forms of a computation share their symbols, so that sums keep the common dependence on them, where intervals
/// would add up widths (de Figueiredo, Stolfi, Numerical Algorithms 2004). Every operation encloses: for each value of
/// the symbols, the result contains f(x, y) for all x and y that the operands contain. Products of symbols and
/// round-off go to the radius. A factor that is exactly 0 makes a product exactly 0.
struct AffineForm {
  double centre = 0;
  std::vector<double> slopes;  ///< a_k; those beyond the end are 0
  double radius = 0;

  AffineForm(double value = 0) : centre(value) {}  // NOLINT: a double is a form
  /// The form of an interval, without symbols.
  AffineForm(Interval values);  // NOLINT: so is an interval

  bool is_zero() const { return centre == 0 && slopes.empty() && radius == 0; }
  /// Returns an upper bound on |x - centre|.
  double deviation() const;
  Interval range() const;
  /// Encloses the largest of all values, if each of the first `count` symbols can have any value in [-1, 1].
  Interval largest(std::size_t count) const;
  /// Returns the form with symbols k, k + 1, ... moved to the radius.
  AffineForm without_symbols_from(std::size_t k) const;
};

/// Encloses the decimal number to which x is the nearest double.
inline Interval decimal(double x) { return {down(x), up(x)}; }
/// Returns e_k.
AffineForm symbol(std::size_t k);

AffineForm operator+(const AffineForm& a, const AffineForm& b);
AffineForm operator-(const AffineForm& a);
AffineForm operator-(const AffineForm& a, const AffineForm& b);
AffineForm operator*(const AffineForm& a, const AffineForm& b);
/// The whole line if b contains 0.
AffineForm operator/(const AffineForm& a, const AffineForm& b);

/// By Taylor around the centre, f(c) + f'(c)(x - c) + f''(X)/2 [0, |x - c|^2].
AffineForm sin(const AffineForm& x);
AffineForm cos(const AffineForm& x);
/// 1 / (1 + e^-x).
AffineForm sigmoid(const AffineForm& x);
/// max(x, 0), between the chord and its parallel below.
AffineForm relu(const AffineForm& x);

using AffineVector = std::vector<AffineForm>;

/// Returns the number of symbols that the forms use.
std::size_t symbols(const AffineVector& x);
/// Returns the same sets with the radii as symbols `first`, `first` + 1, ..., which no other form may use, so that
/// later results remember what depends on them.
AffineVector with_radii_as_symbols(AffineVector x, std::size_t first);
/// Returns bias + weights[0] x[0] + weights[1] x[1] + ...; rounds less and faster than the operators.
/// @param weights one per form.
AffineForm weighted_sum(double bias, const double* weights, const AffineVector& x);

}  // namespace swarmcert::stability
