#include "lipschitz/checker/fixed_point.h"

#include <algorithm>

namespace swarmcert::check {
namespace {

mpz_class one() { return mpz_class(1) << kFixedBits; }

/// Floor and ceiling of a / 2^bits.
mpz_class floor_shift(const mpz_class& a, mp_bitcnt_t bits) {
  mpz_class result;
  mpz_fdiv_q_2exp(result.get_mpz_t(), a.get_mpz_t(), bits);
  return result;
}
mpz_class ceil_shift(const mpz_class& a, mp_bitcnt_t bits) {
  mpz_class result;
  mpz_cdiv_q_2exp(result.get_mpz_t(), a.get_mpz_t(), bits);
  return result;
}

mpz_class floor_quotient(const mpz_class& a, const mpz_class& b) {
  mpz_class result;
  mpz_fdiv_q(result.get_mpz_t(), a.get_mpz_t(), b.get_mpz_t());
  return result;
}
mpz_class ceil_quotient(const mpz_class& a, const mpz_class& b) {
  mpz_class result;
  mpz_cdiv_q(result.get_mpz_t(), a.get_mpz_t(), b.get_mpz_t());
  return result;
}

Fixed over(const Fixed& a, unsigned long n) {
  return {floor_quotient(a.lower, mpz_class(n)), ceil_quotient(a.upper, mpz_class(n))};
}

/// arctan(1 / n) for an integer n > 1: 1/n - 1/(3 n^3) + ..., whose partial sums alternately lie above and below it.
Fixed arctan_of_inverse(unsigned long n) {
  const Fixed square = Fixed::ratio(1, mpz_class(n) * n);
  Fixed power = Fixed::ratio(1, n), sum(0, 0);
  for (unsigned long k = 0; power.upper > 1; ++k, power = power * square) {
    const Fixed term = over(power, 2 * k + 1);
    sum = k % 2 == 0 ? sum + term : sum - term;
  }
  return {sum.lower - power.upper, sum.upper + power.upper};  // the remainder is at most the next power
}

/// 1 / sqrt(2 pi), with pi = 16 arctan(1/5) - 4 arctan(1/239) (Machin).
const Fixed& inverse_root_of_two_pi() {
  static const Fixed value = [] {
    const Fixed a = arctan_of_inverse(5), b = arctan_of_inverse(239);
    const mpz_class low = 2 * (16 * a.lower - 4 * b.upper), high = 2 * (16 * a.upper - 4 * b.lower);
    const mpz_class root = sqrt(mpz_class(low << kFixedBits)),
                    above = sqrt(mpz_class(high << kFixedBits)) + 1;
    return Fixed(one(), one()) / Fixed(root, above);
  }();
  return value;
}

}  // namespace

Dyadic floor_to(const Dyadic& x, long unit) {
  if (x.exponent >= unit) return x;
  return {floor_shift(x.mantissa, static_cast<mp_bitcnt_t>(unit - x.exponent)), unit};
}

Dyadic ceil_to(const Dyadic& x, long unit) { return -floor_to(-x, unit); }

Fixed::Fixed(const Dyadic& x) {
  const auto units = [](const Dyadic& on_grid) {
    return mpz_class(on_grid.mantissa << static_cast<mp_bitcnt_t>(on_grid.exponent + kFixedBits));
  };
  lower = units(floor_to(x, -kFixedBits));
  upper = units(ceil_to(x, -kFixedBits));
}

Fixed Fixed::ratio(const mpz_class& numerator, const mpz_class& denominator) {
  const mpz_class scaled = numerator << kFixedBits;
  return {floor_quotient(scaled, denominator), ceil_quotient(scaled, denominator)};
}

Fixed operator+(const Fixed& a, const Fixed& b) { return {a.lower + b.lower, a.upper + b.upper}; }
Fixed operator-(const Fixed& a) { return {-a.upper, -a.lower}; }
Fixed operator-(const Fixed& a, const Fixed& b) { return {a.lower - b.upper, a.upper - b.lower}; }

Fixed operator*(const Fixed& a, const Fixed& b) {
  const std::initializer_list<mpz_class> products = {a.lower * b.lower, a.lower * b.upper, a.upper * b.lower,
                                                     a.upper * b.upper};
  return {floor_shift(std::min(products), kFixedBits), ceil_shift(std::max(products), kFixedBits)};
}

Fixed operator/(const Fixed& a, const Fixed& b) {
  const mpz_class low = a.lower << kFixedBits, high = a.upper << kFixedBits;
  return {floor_quotient(low, low >= 0 ? b.upper : b.lower),
          ceil_quotient(high, high >= 0 ? b.lower : b.upper)};
}

/// e^-x = (1 / e^y)^4096, y = x / 4096 < 180 / 4096 < 2^-4.5. The series of e^y ends with y^32/32!; the remainder is
/// less than twice y^33/33! < 2^-148 2^-122, hence less than one unit.
Fixed exp_of_minus(const Fixed& x) {
  constexpr int kHalvings = 12;
  constexpr unsigned long kTerms = 32, kVanishes = 180;  // e^-180 < 2^-256
  if (x.lower >= kVanishes * one()) return {0, 1};
  const Fixed y(floor_shift(x.lower, kHalvings),
                ceil_shift(std::min<mpz_class>(x.upper, kVanishes * one()), kHalvings));
  Fixed sum(one(), one()), term = sum;
  for (unsigned long k = 1; k <= kTerms; ++k) {
    term = over(term * y, k);
    sum = sum + term;
  }
  ++sum.upper;
  Fixed result = Fixed(one(), one()) / sum;
  for (int k = 0; k < kHalvings; ++k) result = result * result;
  if (x.upper > kVanishes * one()) result.lower = 0;
  return result;
}

/// ln(1 + x) = 2 artanh z = 2 (z + z^3/3 + ...), z = x / (2 + x) <= 1/3. The remainder after z^169/169 is less than 9/8
/// of z^171/171 < 2^-270.
Fixed log_of_one_plus(const Fixed& x) {
  constexpr unsigned long kLast = 169;
  const Fixed z = x / (x + Fixed(2 * one(), 2 * one())), square = z * z;
  Fixed power = z, sum(0, 0);
  for (unsigned long k = 1; k <= kLast; k += 2) {
    sum = sum + over(power, k);
    power = power * square;
  }
  ++sum.upper;
  return {2 * sum.lower, 2 * sum.upper};
}

Fixed normal_density(const Fixed& x) {
  const Fixed square = x * x;
  return exp_of_minus(over({std::max<mpz_class>(square.lower, 0), square.upper}, 2)) *
         inverse_root_of_two_pi();
}

/// For x >= 0: 1/2 + phi(x) (x + x^3/3 + x^5/(3 5) + ...). Once 2 k + 3 > 2 x^2, each term is at most half of the
/// previous one, so the remainder is at most the last term. For x >= 14 the value is between 1 - e^-98 / 2 and 1.
Fixed normal_probability(const Fixed& x) {
  if (x.upper < 0) return Fixed(one(), one()) - normal_probability(-x);
  if (x.lower < 0) {  // an enclosure of 0: the density is below 1/2
    const mpz_class half = one() / 2, width = std::max<mpz_class>(-x.lower, x.upper);
    return {half - width, half + width};
  }
  constexpr unsigned long kFar = 14, kTail = 141;  // e^-98 / 2 < 2^-141
  if (x.lower >= kFar * one()) return {one() - (one() >> kTail), one()};
  const Fixed square = x * x;
  Fixed term = x, sum = x;
  for (unsigned long k = 0;; ++k) {
    term = over(term * square, 2 * k + 3);
    sum = sum + term;
    if (term.upper <= 1 && (2 * k + 5) * one() >= 2 * square.upper) break;
  }
  sum.upper += term.upper;
  Fixed result = Fixed(one() / 2, one() / 2) + normal_density(x) * sum;
  result.upper = std::min<mpz_class>(result.upper, one());
  return result;
}

}  // namespace swarmcert::check
