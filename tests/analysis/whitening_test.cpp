#include "analysis/identification/whitening.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace swarmcert::identification {
namespace {

constexpr double kStep_s = 0.01;
constexpr int kSamples = 60'000;

/// A Gauss-Markov gust of variance 1 plus white noise.
std::vector<double> gusty(const Noise& noise) {
  std::mt19937 generator(4);
  std::normal_distribution<double> normal;
  const double keep = std::exp(-kStep_s / noise.forget_s);
  std::vector<double> r;
  double gust = 0;
  for (int i = 0; i < kSamples; ++i) {
    gust = keep * gust + std::sqrt(1 - keep * keep) * normal(generator);
    r.push_back(gust + std::sqrt(noise.white_share) * normal(generator));
  }
  return r;
}

double correlation(const std::vector<double>& r, std::size_t lag) {
  double product = 0, square = 0;
  for (std::size_t i = lag; i < r.size(); ++i) {
    product += r[i] * r[i - lag];
    square += r[i] * r[i];
  }
  return product / square;
}

Noise noise_of(const std::vector<double>& r) {
  Autocovariance sums;
  sums.add(r, std::vector<char>(r.size(), 0), 10);
  return sums.noise();
}

TEST(Whitening, InnovationsOfAGustAreNotCorrelated) {
  const Noise truth = {0.8, 0.2};
  const std::vector<double> r = gusty(truth);
  ASSERT_GT(correlation(r, 1), 0.7);
  Whitening filter(truth);
  std::vector<double> innovations;
  for (std::size_t i = 0; i < r.size(); ++i)
    innovations.push_back(filter.advance(Eigen::Vector3d(r[i], 0, 0), kStep_s, i == 0)(0, 0));
  for (std::size_t lag = 1; lag <= 20; ++lag)  // 4 standard deviations of a sample correlation
    EXPECT_LT(std::abs(correlation(innovations, lag)), 4 / std::sqrt(kSamples)) << lag;
}

TEST(Whitening, TheGustIsEstimatedFromTheResidual) {
  const Noise found = noise_of(gusty({0.8, 0.2}));
  EXPECT_NEAR(found.forget_s, 0.8, 0.15);
  EXPECT_NEAR(found.white_share, 0.2, 0.04);
}

TEST(Whitening, WhiteNoiseNeedsNoFilter) {
  std::mt19937 generator(5);
  std::normal_distribution<double> normal;
  std::vector<double> r;
  for (int i = 0; i < kSamples; ++i) r.push_back(normal(generator));
  EXPECT_EQ(noise_of(r).forget_s, 0);
}

TEST(Whitening, AVibrationIsRemovedAndTheRestIsKept) {
  constexpr double kVibration_hz = 7.3, kTurn = 2 * 3.14159265358979323846;
  const auto power_after = [&](double frequency_hz) {
    Notch notch(kVibration_hz);
    double power = 0;
    for (int i = 0; i < 2000; ++i) {
      const double x = std::sin(kTurn * frequency_hz * i * kStep_s);
      const double y = notch.advance(Eigen::Vector3d(x, 0, 0), i == 0 ? 0 : kStep_s, i == 0)(0, 0);
      if (i >= 1000) power += 2 * y * y / 1000;
    }
    return power;
  };
  EXPECT_LT(power_after(kVibration_hz), 1e-6);
  EXPECT_LT(power_after(kVibration_hz + 0.05), 0.02) << "the frequency is not known exactly";
  for (const double other_hz : {0.5, 2.0, 4.5, 11.0, 25.0})
    EXPECT_NEAR(power_after(other_hz), 1, 0.1) << other_hz;
}

TEST(Whitening, NothingIsTakenFromBeforeARestart) {
  Autocovariance sums;
  std::vector<char> restarts(40, 0);
  restarts[20] = 1;
  sums.add(std::vector<double>(40, 1.0), restarts, 5);
  EXPECT_EQ(sums.counts[1], 2 * 15);
  EXPECT_EQ(sums.counts[2], 2 * 10);
}

}  // namespace
}  // namespace swarmcert::identification
