#include "stability/reach/flow.h"

#include <cmath>

#include "stability/reach/time_series.h"
#include "tests/reach/random_forms.h"

namespace swarmcert::stability {
namespace {

using Series = std::vector<TimeSeries>;

const AffineForm kHalf = AffineForm(0.5) * symbol(0);

TEST(TimeSeries, SinesAndQuotientsHaveTheirTaylorCoefficients) {
  const TimeSeries t(AffineVector{0, 1, 0, 0, 0, 0});
  const auto [s, c] = sin_and_cos(t);
  const TimeSeries geometric = TimeSeries(1.0) / (TimeSeries(1.0) - t);
  double factorial = 1;
  for (std::size_t k = 0; k < 6; factorial *= static_cast<double>(++k)) {
    const double sign = k % 4 < 2 ? 1 : -1;
    EXPECT_TRUE(tests::contains(s[k], {}, k % 2 == 1 ? sign / factorial : 0, 1e-17)) << k;
    EXPECT_TRUE(tests::contains(c[k], {}, k % 2 == 0 ? sign / factorial : 0, 1e-17)) << k;
    EXPECT_TRUE(tests::contains(geometric[k], {}, 1)) << k;
  }
  EXPECT_LT(s[5].deviation() + geometric[5].deviation(), 1e-13);
}

/// x1'' = -x1, from the points (1 + e/2, 0): x1 = (1 + e/2) cos t.
TEST(Flow, KeepsASetOfOscillatorsAsLargeAsItIs) {
  const auto field = [](const Series& x) { return Series{x[1], -x[0]}; };
  const std::vector<FlowStep> steps = reach([&](const AffineVector&) { return VectorField(field); },
                                            {AffineForm(1) + kHalf, 0}, 0.25, 60, 12);
  for (std::size_t k = 0; k < steps.size(); k += 5) {
    for (const double s : {0.0, 0.1, 0.25}) {
      const AffineForm x = steps[k].at(s)[0];
      const double t = 0.25 * static_cast<double>(k) + s;
      for (const double e : {-1.0, 0.0, 1.0})
        EXPECT_TRUE(tests::contains(x, {e}, (1 + e / 2) * std::cos(static_cast<long double>(t)))) << t;
      EXPECT_LT(x.without_symbols_from(1).radius, 1e-11);
    }
  }
  const Extreme lowest = extreme(steps, 0, 0, Side::kSmallest, 200, 1);
  EXPECT_LE(lowest.value.lower, -1.5);
  EXPECT_GE(lowest.value.upper, -1.5 - 1e-12);
  EXPECT_LT(lowest.value.upper - lowest.value.lower, 5e-7);
  const Extreme highest = extreme(steps, 1, 0, Side::kLargest, 200, 1);
  EXPECT_NEAR(highest.value.upper, 1.5, 5e-7);
  EXPECT_GE(highest.step, 1U);
}

/// x' = x^2: x = x0/(1 - x0 t) leaves every bound.
TEST(Flow, ContainsSolutionsThatGrowAndRefusesStepsBeyondTheirEnd) {
  const auto field = [](const Series& x) { return Series{x[0] * x[0]}; };
  const AffineVector start{AffineForm(1) + AffineForm(0.1) * symbol(0)};
  const FlowStep step = flow(field, start, 0.2, 10);
  for (const double t : {0.05, 0.2}) {
    for (const double e : {-1.0, -0.4, 0.0, 1.0}) {
      const long double x0 = 1 + 0.1L * e;
      EXPECT_TRUE(tests::contains(step.at(t)[0], {e}, x0 / (1 - x0 * t), 1e-16)) << t;
    }
  }
  EXPECT_THROW(flow(field, start, 1.0, 10), std::domain_error);
}

TEST(Flow, StatesThatStayAtZeroAreExactlyZero) {
  const auto field = [](const Series& x) { return Series{x[0] * x[1] + x[0], TimeSeries(1.0) - x[1]}; };
  EXPECT_TRUE(flow(field, {0, kHalf}, 0.5, 8).at(0.5)[0].is_zero());
  EXPECT_FALSE(flow(field, {1e-30, kHalf}, 0.5, 8).at(0.5)[0].is_zero());
  // x1' = x1 + t^16: the Taylor coefficients at 0 are 0, x1 is not.
  const auto late = [](const Series& x) {
    TimeSeries power = x[1];
    for (int k = 0; k < 4; ++k) power = power * power;
    return Series{x[0] + power, 1.0};
  };
  const FlowStep step = flow(late, {0, 0}, 0.5, 8);
  EXPECT_GT(step.everywhere[0][0].range().upper, std::pow(0.5, 17) / 17);
}

}  // namespace
}  // namespace swarmcert::stability
