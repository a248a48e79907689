/// @file Fixed-point numbers, fractions and Gaussian elimination for the checks of tracking gains. Not for users.
#pragma once

#include <gmpxx.h>

#include <cmath>
#include <cstdlib>
#include <optional>
#include <stdexcept>
#include <vector>

#include "stability/checker/gain_bounds.h"

namespace swarmcert::check {

using Rational = mpq_class;
using Integer = mpz_class;
using Row = std::vector<Rational>;
using Square = std::vector<Row>;

inline constexpr mp_bitcnt_t kBits = 128;  ///< a fixed-point number is an integer over 2^kBits
inline constexpr mp_bitcnt_t kFormBits =
    96;  ///< the entries of a stated quadratic form are integers over 2^kFormBits

inline void demand(bool condition, const char* reason) {
  if (!condition) throw std::runtime_error(reason);
}

/// Loops with numbers outside this range are rejected, which excludes underflow and overflow.
inline bool is_usual(double x) { return x >= 0x1p-40 && x <= 0x1p40; }

/// @throws std::runtime_error naming the numbers that are out of range.
void check_numbers(const LoopNumbers& loop);

/// 2^exponent
inline Rational two_to(long exponent) {
  const Integer power = Integer(1) << static_cast<mp_bitcnt_t>(std::labs(exponent));
  return exponent >= 0 ? Rational(power) : Rational(1, power);
}

inline Integer floor_fixed(const Rational& x) {
  const Integer numerator = x.get_num() << kBits;
  Integer result;
  mpz_fdiv_q(result.get_mpz_t(), numerator.get_mpz_t(), x.get_den_mpz_t());
  return result;
}
inline Integer ceil_fixed(const Rational& x) { return -floor_fixed(-x); }
inline Rational as_fraction(const Integer& fixed) {
  return Rational(fixed) * two_to(-static_cast<long>(kBits));
}

/// Upper bound on the product of two nonnegative fixed-point numbers.
inline Integer times_up(const Integer& a, const Integer& b) { return ((a * b) >> kBits) + 1; }

inline Integer root_up(const Integer& x) { return sqrt(x) + 1; }
/// Upper bound on the square root of x >= 0, as a fixed-point number.
inline Integer fixed_root_up(const Rational& x) { return root_up(ceil_fixed(x) << kBits); }

/// Eliminates a symmetric matrix without pivoting, with `right` as right-hand side.
/// @returns right' m^-1 right; nothing unless every pivot is positive, that is, m is positive definite.
std::optional<Rational> inverse_form(Square m, Row right);

/// Returns the quadratic form stated by a witness, as fractions.
/// @throws std::runtime_error unless it is symmetric, has n rows, and its entries are integers over 2^kFormBits.
Square exact_form(const std::vector<std::vector<double>>& stated, std::size_t n);

}  // namespace swarmcert::check
