#include "analysis/residuals/statistics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "analysis/residuals/failing_place.h"
#include "nn/base/random.h"

namespace swarmcert::residuals {
namespace {

TEST(ResidualStatistics, AreThoseOfANumberThatWasWorkedOutByHand) {
  // x: 3, -3, 3, -3; y: always 4; z: 0. The model explains half of x.
  std::vector<Eigen::Vector3f> r, r0;
  for (const float sign : {1.f, -1.f, 1.f, -1.f}) {
    r.emplace_back(3 * sign, 4.f, 0.f);
    r0.emplace_back(6 * sign, 4.f, 0.f);
  }
  const ErrorStatistics s = statistics(r, r0);
  EXPECT_EQ(s.samples, 4u);
  EXPECT_DOUBLE_EQ(s.rmse.x, 3);
  EXPECT_DOUBLE_EQ(s.rmse.y, 4);
  EXPECT_DOUBLE_EQ(s.rmse.total, 5);
  EXPECT_DOUBLE_EQ(s.bias.x, 0);
  EXPECT_DOUBLE_EQ(s.bias.total, 4);
  EXPECT_DOUBLE_EQ(s.max.total, 5);
  EXPECT_DOUBLE_EQ(s.variance_explained.x, 0.75);
  EXPECT_DOUBLE_EQ(s.variance_explained.y, 0) << "does not vary";
  EXPECT_EQ(statistics({}, {}).samples, 0u);
}

TEST(ResidualStatistics, TheTailIsThatOfTheSortedSizes) {
  std::mt19937_64 random(1);
  for (const std::size_t count : {1u, 2u, 19u, 20u, 21u, 999u, 1000u, 1001u, 5000u}) {
    std::vector<Eigen::Vector3f> r;
    std::vector<float> sorted;
    for (std::size_t i = 0; i < count; ++i) {
      r.emplace_back(static_cast<float>(random() % 700) - 350.f, 0.f, 0.f);
      sorted.push_back(std::abs(r.back()[0]));
    }
    std::sort(sorted.begin(), sorted.end());
    const auto at = [&](double p) {
      const auto rank = static_cast<std::size_t>(std::ceil(p * static_cast<double>(count)));
      return static_cast<double>(sorted[rank - 1]);
    };
    const ErrorStatistics s = statistics(r, r);
    EXPECT_EQ(s.p95.x, at(0.95)) << count;
    EXPECT_EQ(s.p999.x, at(0.999)) << count;
    EXPECT_EQ(s.max.x, static_cast<double>(sorted.back())) << count;
  }
}

TEST(ResidualStatistics, AQuantileLeavesNoMoreThanItsShareAbove) {
  std::vector<double> values;
  for (int k = 1; k <= 20; ++k) values.push_back(k);
  EXPECT_EQ(quantile(values, 0.95), 19);
  EXPECT_EQ(quantile(values, 1), 20);
  EXPECT_EQ(quantile(values, 0), 1);
  EXPECT_EQ(quantile(values, 0.951), 20);
  std::vector<double> none;
  EXPECT_EQ(quantile(none, 0.5), 0);
}

TEST(ResidualStatistics, ResampledBlocksCoverTheRootMeanSquareAsOftenAsStated) {
  files::Random random(12);
  int held = 0;
  constexpr int kRuns = 300;
  for (int run = 0; run < kRuns; ++run) {
    std::vector<BlockSum> blocks(60);
    for (BlockSum& block : blocks) {
      const double power = 1 + 0.5 * random.symmetric();  // mean 1, and so is that of the squares
      block = {Eigen::Vector3d::Constant(100 * power), 100};
    }
    const Interval x = bootstrap_rmse(blocks, static_cast<std::uint64_t>(run)).value()[0];
    EXPECT_LT(x.lower, x.upper);
    held += x.lower <= 1 && 1 <= x.upper ? 1 : 0;
  }
  // Binomial with 0.9: within four standard deviations, plus the bias of a few percent of the bootstrap.
  EXPECT_GT(held, 0.9 * kRuns - 4 * std::sqrt(0.09 * kRuns));
  EXPECT_LT(held, kRuns);
}

/// A minute at 100 Hz: white noise of variance 1, a slow drift, and a vibration of this amplitude along z.
Spectrum spectrum_with(double amplitude, double frequency_hz) {
  constexpr double kStep_s = 0.01, kTurn = 2 * 3.14159265358979323846;
  std::mt19937_64 random(2);
  std::normal_distribution<double> normal;
  std::vector<Eigen::Vector3d> residual;
  for (int i = 0; i < 6000; ++i) {
    const double time_s = i * kStep_s, drift = std::sin(kTurn * 0.4 * time_s);
    residual.emplace_back(normal(random) + drift, normal(random),
                          normal(random) + amplitude * std::sin(kTurn * frequency_hz * time_s));
  }
  Spectrum spectrum;
  spectrum.add(residual, kStep_s);
  return spectrum;
}

TEST(ResidualStatistics, AVibrationIsALineOfTheSpectrumAndADriftIsNone) {
  for (const double frequency_hz : {4.6, 7.3, 12.25, 31.0}) {
    const SpectralLine line = spectrum_with(2, frequency_hz).line();
    EXPECT_NEAR(line.frequency_hz, frequency_hz, 0.05);
    EXPECT_EQ(line.axis, 2);
    EXPECT_NEAR(line.share, 2.0 / 3, 0.05) << "2 N^2 of 3 N^2";
  }
  EXPECT_FALSE(spectrum_with(0.3, 7.3).line().is_found());
  EXPECT_FALSE(spectrum_with(2, 1.5).line().is_found()) << "within the low band";
}

TEST(ResidualStatistics, FewerThanFiveBlocksHaveNoInterval) {
  std::vector<BlockSum> blocks(4, {Eigen::Vector3d(4, 9, 36), 1});
  EXPECT_FALSE(bootstrap_rmse(blocks, 1).has_value());
  blocks.push_back(blocks.back());
  const auto intervals = bootstrap_rmse(blocks, 1);
  ASSERT_TRUE(intervals.has_value());
  EXPECT_EQ((*intervals)[3], Interval(7)) << "all blocks are equal";
}

/// 1000 records with noise of 1 N along each axis and, in the first `in_region`, this force.
Comparison with_force(const Eigen::Vector3f& force_N, std::size_t in_region) {
  files::Random random(5);
  std::vector<Eigen::Vector3f> all;
  for (std::size_t i = 0; i < 1000; ++i) {
    const Eigen::Vector3d noise_N(random.bell(), random.bell(), random.bell());
    all.push_back(noise_N.cast<float>() + (i < in_region ? force_N : Eigen::Vector3f::Zero()));
  }
  const std::vector<Eigen::Vector3f> first(all.begin(), all.begin() + 250),
      rest(all.begin() + 250, all.end());
  Comparison comparison;
  comparison.overall.statistics = statistics(all, all);
  comparison.overall.noise_floor_N = Eigen::Vector3d::Ones();
  comparison.regions = {{0, 0, region_name(0, 0), 0, statistics(first, first)},
                        {0, 1, region_name(0, 1), 0, statistics(rest, rest)}};
  return comparison;
}

TEST(FailingPlace, IsNowhereForNoiseEverywhereForAConstantForceAndTheRegionOfALocalOne) {
  using Where = FailingPlace::Where;
  const ForceUnit unit;
  EXPECT_EQ(failing_place(with_force({0, 0, 0}, 0), unit).where, Where::kNowhere);
  const FailingPlace everywhere = failing_place(with_force({0, -10, 0}, 1000), unit);
  EXPECT_EQ(everywhere.where, Where::kEverywhere);
  EXPECT_NE(everywhere.words.find("towards -y"), std::string::npos) << everywhere.words;
  EXPECT_NEAR(everywhere.share, 100.0 / 103, 0.02);
  const FailingPlace region = failing_place(with_force({0, 0, 10}, 250), unit);
  EXPECT_EQ(region.where, Where::kRegion);
  EXPECT_NE(region.words.find(region_name(0, 0)), std::string::npos) << region.words;
  // The mean of all is 2.5 N, of the region 10 N: 0.25 * 7.5^2 of 28 N^2.
  EXPECT_NEAR(region.share, 0.25 * 7.5 * 7.5 / 28, 0.03);
}

TEST(FailingPlace, IsNotTheThrustWithWhichTheControllerAnswersIfAnotherRegimeHoldsATenth) {
  constexpr int kThrust = 2;
  ASSERT_TRUE(is_reaction(kThrust));
  Comparison comparison = with_force({0, 0, 10}, 250);
  RegionErrors answer = comparison.regions[0];
  answer.variable = kThrust;
  answer.name = region_name(kThrust, 0);
  answer.statistics.bias.z += 5;
  comparison.regions.push_back(answer);
  EXPECT_EQ(failing_place(comparison, {}).variable, 0);
  comparison.regions.erase(comparison.regions.begin());
  comparison.regions[0].statistics.bias = comparison.overall.statistics.bias;
  EXPECT_EQ(failing_place(comparison, {}).variable, kThrust)
      << "where nothing else fails, the thrust is the cause";
}

TEST(FailingPlace, OfNoRecordIsNoPlaceWithoutNoise) {
  EXPECT_EQ(failing_place({}, {}).words, "no record is judged");
}

TEST(FailingPlace, IsScatteredWhereTheForceIsNotThatOfARegime) {
  Comparison comparison = with_force({0, 0, 0}, 0);
  comparison.overall.noise_floor_N /= 10;
  EXPECT_EQ(failing_place(comparison, ForceUnit()).where, FailingPlace::Where::kScattered);
}

}  // namespace
}  // namespace swarmcert::residuals
