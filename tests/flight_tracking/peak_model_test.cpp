#include "analysis/tracking/peak_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

namespace swarmcert::analysis {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Peaks 2 first + 0.5 second, times e^(noise), from gains that determine the parts.
std::vector<FlownPeak> synthetic(int groups, double noise, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> part(0.01, 0.1);
  std::normal_distribution<double> normal;
  std::vector<FlownPeak> flights;
  for (int k = 0; k < groups; ++k) {
    const double first = part(random), second = part(random), third = part(random);
    for (int n = 0; n < 2; ++n) {
      flights.push_back({std::to_string(k),
                         (2 * first + 0.5 * second) * std::exp(noise * normal(random)),
                         0,
                         {first, second, third}});
    }
  }
  return flights;
}

TEST(NonnegativeLeastSquares, KeepsTheConditionsOfOptimality) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  int at_bound = 0;
  for (int run = 0; run < 200; ++run) {
    const auto draw = [&] { return normal(random); };
    const Eigen::MatrixXd A = Eigen::MatrixXd::NullaryExpr(8, 5, draw);
    const Eigen::VectorXd b = Eigen::VectorXd::NullaryExpr(8, draw);
    const Eigen::VectorXd x = nonnegative_least_squares(A.transpose() * A, A.transpose() * b);
    const Eigen::VectorXd slope = A.transpose() * (A * x - b);
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      EXPECT_GE(x[i], 0);
      EXPECT_GE(slope[i], -1e-8);
      EXPECT_NEAR(slope[i] * x[i], 0, 1e-8);
      at_bound += x[i] == 0 ? 1 : 0;
    }
  }
  EXPECT_GT(at_bound, 100);
}

TEST(PeakModel, FindsTheSizesOfTheDisturbances) {
  const PeakModel model = calibrate_peaks(synthetic(40, 0, 1), 0.9);
  ASSERT_EQ(model.weights.size(), 3u);
  EXPECT_NEAR(model.weights[0], 2, 1e-3);
  EXPECT_NEAR(model.weights[1], 0.5, 1e-3);
  EXPECT_NEAR(model.weights[2], 0, 1e-3);
  EXPECT_NEAR(model.promise.threshold, 1, 1e-3);
}

TEST(PeakModel, NeverFallsWhereAPartRises) {
  const std::vector<FlownPeak> flights = synthetic(40, 0.5, 2);
  const PeakModel model = calibrate_peaks(flights, 0.9);
  for (const FlownPeak& flight : flights) {
    for (std::size_t k = 0; k < flight.parts.size(); ++k) {
      FlownPeak worse = flight;
      worse.parts[k] *= 3;
      EXPECT_GE(model.bound_m(worse), model.bound_m(flight));
    }
  }
}

TEST(PeakModel, CoversGainSetsThatItHasNotSeen) {
  int covered = 0, flights = 0;
  for (unsigned seed = 0; seed < 20; ++seed) {
    const PeakModel model = calibrate_peaks(synthetic(40, 0.3, 100 + seed), 0.9);
    for (const FlownPeak& flight : synthetic(40, 0.3, 500 + seed)) {
      covered += flight.peak_m <= model.bound_m(flight) ? 1 : 0;
      ++flights;
    }
  }
  EXPECT_NEAR(static_cast<double>(covered) / flights, 0.9, 0.03);
}

TEST(PeakModel, OneWildFlightHardlyChangesTheSizes) {
  std::vector<FlownPeak> flights = synthetic(40, 0.05, 3);
  flights[0].peak_m *= 20;
  const PeakModel model = calibrate_peaks(flights, 0.9);
  EXPECT_NEAR(model.weights[0], 2, 0.2);
}

TEST(PeakModel, AKnownPartIsNoDisturbance) {
  std::vector<FlownPeak> flights = synthetic(40, 0, 4);
  for (FlownPeak& flight : flights) {
    flight.known_m = 0.3;
    flight.peak_m += 0.3;
  }
  const PeakModel model = calibrate_peaks(flights, 0.9);
  EXPECT_NEAR(model.weights[0], 2, 1e-2);
  EXPECT_NEAR(model.weights[1], 0.5, 1e-2);
}

TEST(PeakModel, AnUnstableLoopCountsAsTheWorstOneAndExtrapolates) {
  std::vector<FlownPeak> flights = synthetic(40, 0.1, 5);
  const PeakModel model = calibrate_peaks(flights, 0.9);
  FlownPeak unstable = flights.front();
  unstable.parts = {kInfinity, kInfinity, kInfinity};
  EXPECT_TRUE(model.extrapolates(unstable));
  EXPECT_FALSE(model.extrapolates(flights.front()));
  EXPECT_TRUE(std::isfinite(model.bound_m(unstable)));
  for (const FlownPeak& flight : flights) EXPECT_GE(model.bound_m(unstable), model.bound_m(flight));
}

TEST(PeakModel, RefusesTooFewGainSets) {
  EXPECT_THROW(calibrate_peaks(synthetic(8, 0.1, 6), 0.9), std::invalid_argument);
  EXPECT_NO_THROW(calibrate_peaks(synthetic(9, 0.1, 6), 0.9));
}

}  // namespace
}  // namespace swarmcert::analysis
