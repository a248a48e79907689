#include "lipschitz/base/rounding.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "nn/base/doubles.h"

namespace swarmcert::lipschitz {

using check::Dyadic;

namespace {

/// Returns fraction and exponent such that x = fraction * 2^exponent up to truncation, 1/2 <= |fraction| < 1.
double fraction_of(const Dyadic& x, long* exponent) {
  const double fraction = mpz_get_d_2exp(exponent, x.mantissa.get_mpz_t());
  *exponent += x.exponent;
  return fraction;
}

double scaled(double x, long exponent) {
  return std::ldexp(x, static_cast<int>(std::clamp(exponent, -3000L, 3000L)));
}

}  // namespace

double rounded_up(const Dyadic& x) {
  if (x.sign() == 0) return 0;
  long exponent = 0;
  const double fraction = fraction_of(x, &exponent);
  if (exponent > 1024) return x.sign() > 0 ? kInfinity : std::numeric_limits<double>::lowest();
  double result = scaled(fraction, exponent);
  while (std::isfinite(result) && !(Dyadic(result) >= x)) result = up(result);
  return result;
}

double rounded_down(const Dyadic& x) { return -rounded_up(-x); }

double sqrt_up(const Dyadic& square) {
  if (square.sign() == 0) return 0;
  const auto is_enough = [&square](double x) { return Dyadic(x) * x >= square; };
  long exponent = 0;
  const double fraction = fraction_of(square, &exponent);
  // Squares may leave the range of double, so half of the even exponent is applied to the root.
  const long odd = exponent & 1;
  double root = scaled(std::sqrt(odd != 0 ? 2 * fraction : fraction), (exponent - odd) / 2);
  while (std::isfinite(root) && !is_enough(root)) root = up(root);
  while (std::isfinite(root) && is_enough(down(root))) root = down(root);
  return root;
}

std::optional<float> nearest_float(double x, double low, double high) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  auto value = static_cast<float>(std::max(low, std::min(x, high)));
  if (static_cast<double>(value) < low) value = std::nextafter(value, kInfinity);
  if (static_cast<double>(value) > high) value = std::nextafter(value, -kInfinity);
  if (static_cast<double>(value) < low) return std::nullopt;
  return value;
}

}  // namespace swarmcert::lipschitz
