/// @file Fixed-point interval arithmetic with 256 fractional bits, and the elementary functions of activations. Not for
/// users.
#pragma once

#include <gmpxx.h>

#include "lipschitz/checker/dyadic.h"

namespace swarmcert::check {

/// Number of fractional bits.
inline constexpr long kFixedBits = 256;

/// lower 2^-kFixedBits <= x <= upper 2^-kFixedBits. Every operation encloses the exact result.
struct Fixed {
  mpz_class lower, upper;

  Fixed(mpz_class low, mpz_class high) : lower(std::move(low)), upper(std::move(high)) {}
  explicit Fixed(const Dyadic& x);
  /// Encloses numerator / denominator. Precondition: denominator > 0.
  static Fixed ratio(const mpz_class& numerator, const mpz_class& denominator);
};

Fixed operator+(const Fixed& a, const Fixed& b);
Fixed operator-(const Fixed& a);
Fixed operator-(const Fixed& a, const Fixed& b);
Fixed operator*(const Fixed& a, const Fixed& b);
/// Precondition: b.lower > 0.
Fixed operator/(const Fixed& a, const Fixed& b);

/// e^-x. Precondition: x.lower >= 0.
Fixed exp_of_minus(const Fixed& x);
/// ln(1 + x). Precondition: 0 <= x <= 1.
Fixed log_of_one_plus(const Fixed& x);
/// e^(-x^2/2) / sqrt(2 pi).
Fixed normal_density(const Fixed& x);
/// (1 + erf(x / sqrt 2)) / 2.
Fixed normal_probability(const Fixed& x);

/// Return the largest multiple of 2^unit that is at most x, and the smallest one that is at least x.
Dyadic floor_to(const Dyadic& x, long unit);
Dyadic ceil_to(const Dyadic& x, long unit);

}  // namespace swarmcert::check
