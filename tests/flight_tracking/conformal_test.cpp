#include "analysis/tracking/conformal.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <stdexcept>

namespace swarmcert::analysis {
namespace {

TEST(Conformal, ThresholdIsTheRankThatTheTheoremNames) {
  // 19 groups, level 0.9: k = ceil(0.9 * 20) = 18.
  std::vector<FlightScore> scores;
  for (int k = 1; k <= 19; ++k) scores.push_back({std::to_string(k), static_cast<double>(k)});
  const ConformalThreshold result = conformal_threshold(scores, 0.9);
  EXPECT_EQ(result.threshold, 18);
  EXPECT_EQ(result.groups, 19);
  EXPECT_EQ(result.flights, 19);
}

TEST(Conformal, NineGroupsAreNeededForNineInTen) {
  EXPECT_EQ(fewest_groups(0.9), 9);
  EXPECT_EQ(fewest_groups(0.5), 1);
  EXPECT_EQ(fewest_groups(0.99), 99);
  std::vector<FlightScore> scores;
  for (int k = 0; k < 8; ++k) scores.push_back({std::to_string(k), 1.0});
  EXPECT_THROW(conformal_threshold(scores, 0.9), std::invalid_argument);
  scores.push_back({"8", 2.0});
  EXPECT_EQ(conformal_threshold(scores, 0.9).threshold, 2);
}

TEST(Conformal, FlightsOfOneGroupWeighAsOne) {
  // 19 groups as above; the largest one flew a hundred times, which would shift a threshold based on the count of
  // flights.
  std::vector<FlightScore> scores;
  for (int k = 1; k <= 18; ++k) scores.push_back({std::to_string(k), static_cast<double>(k)});
  for (int k = 0; k < 100; ++k) scores.push_back({"many", 1000.0 + k});
  EXPECT_EQ(conformal_threshold(scores, 0.9).threshold, 18);
}

TEST(Conformal, RefusesLevelsThatAreNone) {
  for (const double level : {0.0, 1.0, -0.5, 1.5, std::nan("")})
    EXPECT_THROW(conformal_threshold({{"a", 1}, {"b", 2}}, level), std::invalid_argument) << level;
}

TEST(Conformal, BetaQuantilesAreThoseOfKnownDistributions) {
  // Beta(1, 1) is uniform; Beta(2, 1) has the distribution function x^2; Beta(1, n): 1 - (1 - x)^n.
  EXPECT_NEAR(beta_quantile(1, 1, 0.3), 0.3, 1e-12);
  EXPECT_NEAR(beta_quantile(2, 1, 0.25), 0.5, 1e-12);
  EXPECT_NEAR(beta_quantile(1, 5, 0.05), 1 - std::pow(0.95, 0.2), 1e-12);
}

/// The guarantee itself: over many calibrations with a skewed distribution, a further group is covered as often as
/// stated, and the coverage of single calibrations is within the stated interval nine times out of ten.
TEST(Conformal, CoversFurtherFlightsAsOftenAsItPromises) {
  std::mt19937_64 random(7);
  std::lognormal_distribution<double> score(0, 1.5);
  constexpr int kRepeats = 4000, kGroups = 30;
  int covered = 0, inside = 0;
  for (int n = 0; n < kRepeats; ++n) {
    std::vector<FlightScore> scores;
    for (int k = 0; k < kGroups; ++k) scores.push_back({std::to_string(k), score(random)});
    const ConformalThreshold result = conformal_threshold(scores, 0.9);
    covered += score(random) <= result.threshold ? 1 : 0;
    // P(score <= threshold) of the known distribution.
    const double coverage = 0.5 * std::erfc(-std::log(result.threshold) / 1.5 / std::sqrt(2.0));
    inside += coverage >= result.coverage_90.lower && coverage <= result.coverage_90.upper ? 1 : 0;
  }
  // k/(n + 1) = 28/31 on average; standard deviation 0.005.
  EXPECT_NEAR(static_cast<double>(covered) / kRepeats, 28.0 / 31, 0.02);
  EXPECT_NEAR(static_cast<double>(inside) / kRepeats, 0.9, 0.02);
}

}  // namespace
}  // namespace swarmcert::analysis
