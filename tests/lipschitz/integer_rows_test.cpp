#include "lipschitz/checker/integer_rows.h"

#include <gtest/gtest.h>

#include <random>

#include "lipschitz/checker/lipschitz_lmi.h"

namespace swarmcert::check {
namespace {

using Rows = std::vector<std::vector<mpz_class>>;

mpz_class by_definition(const std::vector<mpz_class>& a, const std::vector<mpz_class>& b, int from,
                        int count) {
  mpz_class sum = 0;
  for (int k = from; k < from + count; ++k)
    sum += a[static_cast<std::size_t>(k)] * b[static_cast<std::size_t>(k)];
  return sum;
}

TEST(IntegerRows, SumsOfTheLargestWordsDoNotOverflow) {
  const mpz_class largest = (mpz_class(1) << IntegerRows::kWordBits) - 1;
  for (const int count : {1, IntegerRows::kAtOnce, IntegerRows::kAtOnce + 1, 1000}) {
    const std::vector<mpz_class> plus(static_cast<std::size_t>(count), largest);
    const std::vector<mpz_class> minus(static_cast<std::size_t>(count), -largest);
    const IntegerRows rows(Rows{plus, minus});
    EXPECT_EQ(rows.inner(0, 0, rows, 0, 0, count), largest * largest * count);
    EXPECT_EQ(rows.inner(0, 0, rows, 1, 0, count), -largest * largest * count);
    EXPECT_EQ(rows.inner(1, 0, rows, 1, 0, count), largest * largest * count);
  }
}

TEST(IntegerRows, AreExactWithinWordsBeyondThemAndBetweenBoth) {
  std::mt19937 generator(1);
  const auto row = [&generator](int bits) {
    std::vector<mpz_class> entries;
    for (int k = 0; k < 150; ++k) {
      mpz_class entry = 0;
      for (int words = 0; words < 10; ++words)
        entry = (entry << 32) + static_cast<unsigned long>(generator());
      entry >>= static_cast<mp_bitcnt_t>(320 - bits);
      entries.push_back(generator() % 2 == 0 ? entry : mpz_class(-entry));
    }
    return entries;
  };
  for (const int bits : {3, 59, 60, 61, 64, 96, 121, 239, 241, 300}) {
    const std::vector<mpz_class> a = row(bits), b = row(60);
    const IntegerRows left(Rows{a}), right(Rows{b});
    for (const int from : {0, 1, 70}) {
      EXPECT_EQ(left.inner(0, from, right, 0, from, 80), by_definition(a, b, from, 80)) << bits << " bits";
      EXPECT_EQ(left.inner(0, from, left, 0, from, 80), by_definition(a, a, from, 80)) << bits << " bits";
    }
  }
}

TEST(ExactProduct, HoldsOverTheWholeRangeOfDouble) {
  const Matrix a(2, 3, {1e300, 5e-324, 3, 0, 0, 0}), b(3, 1, {1e-300, 1, 1e300});
  const Matrix c = product(a, b);
  const Dyadic exact = Dyadic(1e300) * Dyadic(1e-300) + Dyadic(5e-324) + Dyadic(3) * Dyadic(1e300);
  EXPECT_EQ((c(0, 0) - exact).sign(), 0);
  EXPECT_EQ(c(1, 0).sign(), 0);
}

}  // namespace
}  // namespace swarmcert::check
