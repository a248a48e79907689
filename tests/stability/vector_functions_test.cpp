// Tests of the arithmetic in stability/effects/vector_functions.inc.
#include <gtest/gtest.h>

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#include <immintrin.h>
#endif

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <type_traits>
#include <utility>
#include <vector>

#include "stability/bodies/kernel_width.h"
#include "stability/bodies/rigid_bodies.h"
#include "stability/effects/function_tables.h"

namespace swarmcert::stability {
namespace {

#define SWARMCERT_KERNEL_FILE "stability/vector_functions_kernel.inc"
#include "stability/bodies/kernel_widths.inc"

constexpr int kCount = 1 << 18;

struct Widths {
  std::vector<decltype(&narrow::logarithms)> logarithms = {narrow::logarithms};
  std::vector<decltype(&narrow::logarithms)> logarithms_of_one_plus = {narrow::logarithms_of_one_plus};
  std::vector<decltype(&narrow::exponentials)> exponentials = {narrow::exponentials};

  /// The widths that this processor supports.
  Widths() {
#if defined(SWARMCERT_WIDE_KERNELS)
    if (widest_kernels() >= KernelWidth::kAvx2) {
      logarithms.push_back(avx2::logarithms);
      logarithms_of_one_plus.push_back(avx2::logarithms_of_one_plus);
      exponentials.push_back(avx2::exponentials);
    }
    if (widest_kernels() == KernelWidth::kAvx512) {
      logarithms.push_back(avx512::logarithms);
      logarithms_of_one_plus.push_back(avx512::logarithms_of_one_plus);
      exponentials.push_back(avx512::exponentials);
    }
#endif
  }
};

/// Numbers of all magnitudes from e^-600 to e^600, most of them near 1, including the ends of the table's intervals.
Rows numbers() {
  std::mt19937_64 random(21);
  Rows result(lines_for(kCount));
  for (int i = 0; i < kCount; ++i) {
    const double span = i % 4 == 0 ? 600 : i % 4 == 1 ? 3 : 0.5;
    result.data()[i] = std::exp(std::uniform_real_distribution<double>(-span, span)(random));
  }
  int next = 0;
  for (double m = 0.5; m <= 2; m += 1.0 / 32) {
    for (const double x : {std::nextafter(m, 0), m, std::nextafter(m, 4)}) result.data()[next++] = x;
  }
  return result;
}

/// Expects the same results at every width.
template <typename Function, typename... Argument>
std::vector<double> results(const std::vector<Function>& widths, const Rows& x, const Argument&... argument) {
  std::vector<double> first;
  for (const Function function : widths) {
    Rows result(lines_for(kCount));
    function(x.data(), kCount, argument..., result.data());
    const std::vector<double> now(result.data(), result.data() + kCount);
    if (first.empty()) first = now;
    EXPECT_TRUE(now == first) << "width " << &function - widths.data();
  }
  return first;
}

TEST(VectorFunctions, LogarithmIsAsExactAsItSaysAtEveryWidth) {
  if (std::numeric_limits<long double>::digits < 64) GTEST_SKIP() << "long double is double here";
  const Rows x = numbers();
  const std::vector<double> given = results(Widths().logarithms, x);
  long double worst = 0;
  for (std::size_t i = 0; i < given.size(); ++i) {
    const long double exact = std::log(static_cast<long double>(x.data()[i]));
    worst = std::max(worst,
                     std::abs(static_cast<long double>(given[i]) - exact) / std::max(1.0L, std::abs(exact)));
  }
  EXPECT_LT(worst, 2e-16L);
  EXPECT_GT(worst, 1e-16L) << "half a unit in the last place of a number just above 1";
}

TEST(VectorFunctions, LogarithmOfOnePlusASmallNumberKeepsItsDigits) {
  if (std::numeric_limits<long double>::digits < 64) GTEST_SKIP() << "long double is double here";
  Rows y = numbers();
  for (int i = 0; i < kCount; i += 2) y.data()[i] *= 0.25;  // near the point where the formula changes
  const std::vector<double> given = results(Widths().logarithms_of_one_plus, y);
  long double worst = 0;
  for (std::size_t i = 0; i < given.size(); ++i) {
    const long double exact = std::log1p(static_cast<long double>(y.data()[i]));
    worst = std::max(worst, std::abs(static_cast<long double>(given[i]) / exact - 1));
  }
  EXPECT_LT(worst, 6e-16L);
  EXPECT_GT(worst, 1e-16L);
}

TEST(VectorFunctions, ExponentialIsAsExactAsItSaysAtEveryWidth) {
  if (std::numeric_limits<long double>::digits < 64) GTEST_SKIP() << "long double is double here";
  std::mt19937_64 random(22);
  Rows x(lines_for(kCount));
  for (const double factor : {1.0, 1 / 1.3}) {
    for (int i = 0; i < kCount; ++i) {
      const double span = i % 2 == 0 ? 708 / factor : 2;
      x.data()[i] = std::uniform_real_distribution<double>(-span, span)(random);
    }
    x.data()[0] = 708 / factor, x.data()[1] = -708 / factor, x.data()[2] = 0;
    const std::vector<double> given = results(Widths().exponentials, x, factor);
    EXPECT_EQ(given[2], 1);
    long double worst = 0;
    for (std::size_t i = 0; i < given.size(); ++i) {
      const long double exact = std::exp(static_cast<long double>(factor * x.data()[i]));
      worst = std::max(worst, std::abs(static_cast<long double>(given[i]) / exact - 1));
    }
    EXPECT_LT(worst, 2e-16L) << factor;
    EXPECT_GT(worst, 1e-16L) << "half a unit in the last place of a number just above 1";
  }
}

}  // namespace
}  // namespace swarmcert::stability
