#include "lipschitz/checker/dyadic.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "nn/base/random.h"

namespace swarmcert::check {
namespace {

mpq_class rational(const Dyadic& x) {
  mpq_class value(x.mantissa);
  if (x.exponent >= 0)
    mpq_mul_2exp(value.get_mpq_t(), value.get_mpq_t(), static_cast<mp_bitcnt_t>(x.exponent));
  else
    mpq_div_2exp(value.get_mpq_t(), value.get_mpq_t(), static_cast<mp_bitcnt_t>(-x.exponent));
  return value;
}

/// Zeros, extreme and subnormal numbers, and finite doubles with random bits.
std::vector<double> doubles() {
  using Limits = std::numeric_limits<double>;
  std::vector<double> all = {0.0,
                             -0.0,
                             1.0,
                             -1.0,
                             0.1,
                             Limits::max(),
                             -Limits::max(),
                             Limits::min(),
                             Limits::denorm_min(),
                             -3 * Limits::denorm_min(),
                             std::nextafter(1.0, 2.0)};
  files::Random random(1);
  while (all.size() < 300) {
    const std::uint64_t bits = random.bits();
    double x = 0;
    std::memcpy(&x, &bits, sizeof x);
    if (std::isfinite(x)) all.push_back(x);
  }
  return all;
}

TEST(Dyadic, IsExactlyTheDoubleItWasMadeFrom) {
  for (const double x : doubles()) EXPECT_EQ(rational(Dyadic(x)), mpq_class(x)) << x;
}

TEST(Dyadic, SumsProductsAndComparisonsAreThoseOfTheRationalNumbers) {
  const std::vector<double> all = doubles();
  for (const double x : all) {
    for (const double y : all) {
      const Dyadic a = x, b = y;
      const mpq_class p(x), q(y);
      ASSERT_EQ(rational(a + b), p + q) << x << ", " << y;
      ASSERT_EQ(rational(a - b), p - q) << x << ", " << y;
      ASSERT_EQ(rational(a * b), p * q) << x << ", " << y;
      ASSERT_EQ(a >= b, p >= q) << x << ", " << y;
      ASSERT_EQ(a < b, p < q) << x << ", " << y;
    }
    EXPECT_EQ(rational(absolute(x)), abs(mpq_class(x)));
    EXPECT_EQ(Dyadic(x).sign(), sgn(mpq_class(x)));
  }
}

TEST(Dyadic, AMatrixIsRowMajor) {
  const Matrix m(2, 3, {1, 2, 3, 4, 5, 6});
  for (int i = 0; i < 2; ++i)
    for (int j = 0; j < 3; ++j) EXPECT_EQ(rational(m(i, j)), mpq_class(3 * i + j + 1));
}

}  // namespace
}  // namespace swarmcert::check
