#include "stability/reach/affine_form.h"

#include <cmath>
#include <functional>

#include "stability/bounds/enclosures/interval_functions.h"
#include "tests/reach/random_forms.h"

namespace swarmcert::stability {
namespace {

using tests::contains;
using tests::middle;
using tests::random_form;

struct Operation {
  const char* name;
  std::function<AffineForm(const AffineForm&, const AffineForm&)> form;
  std::function<long double(long double, long double)> value;
};

std::vector<Operation> operations() {
  using A = const AffineForm&;
  using L = long double;
  return {{"+", [](A a, A b) { return a + b; }, [](L a, L b) { return a + b; }},
          {"-", [](A a, A b) { return a - b; }, [](L a, L b) { return a - b; }},
          {"*", [](A a, A b) { return a * b; }, [](L a, L b) { return a * b; }},
          {"/", [](A a, A b) { return a / b; }, [](L a, L b) { return a / b; }},
          {"sin", [](A a, A) { return sin(a); }, [](L a, L) { return std::sin(a); }},
          {"cos", [](A a, A) { return cos(a); }, [](L a, L) { return std::cos(a); }},
          {"sigmoid", [](A a, A) { return sigmoid(a); }, [](L a, L) { return 1 / (1 + std::exp(-a)); }},
          {"relu", [](A a, A) { return relu(a); }, [](L a, L) { return std::max(a, L(0)); }},
          {"weighted",
           [](A a, A b) {
             const double weights[] = {0.7, -1.3};
             return weighted_sum(0.1, weights, {a, b});
           },
           [](L a, L b) { return L(0.1) + L(0.7) * a - L(1.3) * b; }}};
}

TEST(AffineForm, EveryOperationContainsTheValuesOfAllPoints) {
  files::Random random(1);
  for (const Operation& operation : operations()) {
    for (int run = 0; run < 2000; ++run) {
      const double size = random.log_uniform(1e-12, 1);
      const AffineForm a = random_form(random, 3 * random.symmetric(), size);
      const AffineForm b = random_form(random, random.uniform() < 0.5 ? -7 : 7, size);
      const AffineForm result = operation.form(a, b);
      ASSERT_LT(result.radius, 200 * size);
      for (int point = 0; point < 8; ++point) {
        std::vector<double> e(3);
        for (double& one : e) one = std::floor(3 * random.uniform()) - 1;  // corners are the worst
        const long double x = middle(a, e) + a.radius * (point % 2 == 0 ? 1 : -1);
        const long double y = middle(b, e) + b.radius * (point / 2 % 2 == 0 ? 1 : -1);
        ASSERT_TRUE(contains(result, e, operation.value(x, y), 1e-18)) << operation.name << ", size " << size;
      }
    }
  }
}

TEST(AffineForm, ErrorsOfSmoothFunctionsShrinkWithTheSquareOfTheSet) {
  for (const Operation& operation : operations()) {
    if (operation.name == std::string("relu")) continue;
    for (const double size : {1e-2, 1e-3, 1e-4}) {
      const AffineForm a = AffineForm(1) + AffineForm(size) * symbol(0),
                       b = AffineForm(2) + AffineForm(size) * symbol(1);
      EXPECT_LT(operation.form(a, b).radius, 1.01 * size * size) << operation.name;
    }
  }
}

TEST(AffineForm, RemembersWhatItDependsOn) {
  const AffineForm x = AffineForm(Interval(1, 3)) + symbol(0), y = x - symbol(0) - symbol(1);
  EXPECT_NEAR(y.deviation(), 2, 1e-12);
  EXPECT_NEAR((y + symbol(1)).deviation(), 1, 1e-12);
  const AffineVector named = with_radii_as_symbols({x, y}, symbols({x, y}));
  EXPECT_EQ(named[0].radius + named[1].radius, 0);
  EXPECT_EQ(symbols(named), 4U);
  EXPECT_NEAR((named[0] - named[0]).deviation(), 0, 1e-12);
  EXPECT_NEAR(named[0].without_symbols_from(1).radius, 1, 1e-12);
  EXPECT_NEAR(y.largest(2).lower, 2 + 1 - 1, 1e-12)
      << "symbols can be chosen, what the radius stands for cannot";
  EXPECT_NEAR(y.largest(2).upper, 2 + 1 + 1, 1e-12);
}

TEST(AffineForm, ZeroStaysExactlyZeroAndUnboundedIsSaid) {
  const AffineForm zero, x = AffineForm(0.3) + symbol(2);
  EXPECT_TRUE((zero * x + sin(zero) / cos(zero)).is_zero());
  EXPECT_EQ((x / (AffineForm(0.5) * symbol(0))).range().upper, kInfinity);
  EXPECT_EQ((AffineForm(1e200) * AffineForm(1e200)).range().upper, kInfinity);
}

TEST(IntervalFunctions, SineAndCosineAreTight) {
  files::Random random(2);
  for (int run = 0; run < 2000; ++run) {
    const double x = 4 * random.symmetric();
    for (const auto& [interval, value] : {std::pair{sin_of(x), std::sin(static_cast<long double>(x))},
                                          std::pair{cos_of(x), std::cos(static_cast<long double>(x))}}) {
      EXPECT_LE(interval.lower, value) << x;
      EXPECT_GE(interval.upper, value) << x;
      EXPECT_LT(interval.upper - interval.lower, 1e-13) << x;
    }
  }
  EXPECT_EQ(sin_of(5), Interval(-1, 1));
}

}  // namespace
}  // namespace swarmcert::stability
