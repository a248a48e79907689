#include "stability/simulation/ode_integrator.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace swarmcert::stability {
namespace {

constexpr OdeMethod kMethods[] = {OdeMethod::kBdf, OdeMethod::kAdams, OdeMethod::kRungeKutta};
constexpr double kTolerance = 1e-9;
constexpr double kGlobalError = 1e-5;  ///< accumulated local errors of kTolerance
constexpr double kPi = 3.14159265358979324;

/// x'' = -x from x = 1, x' = 0: x = cos t.
void oscillate(double, const double* y, double* dy) {
  dy[0] = y[1];
  dy[1] = -y[0];
}
constexpr double kStart[] = {1, 0};

TEST(OdeIntegrator, EveryMethodFollowsTheClosedForm) {
  for (const OdeMethod method : kMethods) {
    OdeIntegrator integrator(method, oscillate, kTolerance, {kTolerance, kTolerance});
    integrator.start(0, kStart);
    for (int k = 1; k <= 50; ++k) {
      const double t = 0.2 * k;
      EXPECT_TRUE(integrator.advance(t, 100).empty());
      ASSERT_NEAR(integrator.time(), t, 1e-12);
      ASSERT_NEAR(integrator.state()[0], std::cos(t), kGlobalError);
      ASSERT_NEAR(integrator.state()[1], -std::sin(t), kGlobalError);
    }
    EXPECT_GT(integrator.evaluations(), 0);
  }
}

TEST(OdeIntegrator, StopsAtEachSignChangeAndSaysWhichValueHasIt) {
  for (const OdeMethod method : kMethods) {
    OdeIntegrator integrator(method, oscillate, kTolerance, {kTolerance, kTolerance});
    integrator.watch(2, [](double, const double* y, double* g) { std::copy(y, y + 2, g); });
    integrator.start(0, kStart);
    integrator.advance(0.5, 100);   // away from x' = 0 at the start
    for (int k = 1; k <= 6; ++k) {  // x = 0 at pi/2, x' = 0 at pi, and so on in turn
      const std::vector<int> stopped_by = integrator.advance(20, 100);
      ASSERT_EQ(stopped_by, std::vector<int>{k % 2 == 1 ? 0 : 1});
      ASSERT_NEAR(integrator.time(), k * kPi / 2, kGlobalError);
    }
  }
}

TEST(OdeIntegrator, NeverEvaluatesBeyondTheLimit) {
  for (const OdeMethod method : kMethods) {
    double latest = 0;
    OdeIntegrator integrator(method,
                             [&latest](double t, const double* y, double* dy) {
                               latest = std::max(latest, t);
                               oscillate(t, y, dy);
                             },
                             kTolerance, {kTolerance, kTolerance});
    integrator.start(0, kStart);
    integrator.advance(1.7, 2);
    EXPECT_LE(latest, 2 + 1e-12);
    EXPECT_GT(latest, 1.5);
  }
}

TEST(OdeIntegrator, GivesUpAloudWhereNoStepMeetsTheTolerance) {
  for (const OdeMethod method : kMethods) {
    // y' = y^2 from 1 diverges at t = 1.
    OdeIntegrator integrator(method, [](double, const double* y, double* dy) { dy[0] = y[0] * y[0]; },
                             kTolerance, {kTolerance});
    const double one = 1;
    integrator.start(0, &one);
    EXPECT_THROW(integrator.advance(2, 3), IntegrationError);
  }
}

}  // namespace
}  // namespace swarmcert::stability
