#include "analysis/identification/clocks/clock_relation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace swarmcert::identification {
namespace {

constexpr std::size_t kNarrowest = 20, kOffsets = 1000;
constexpr double kTailScale = 10;

/// Ratios of unrelated offsets: chance alone, correlated over about ten offsets.
std::vector<double> unrelated_ratios(unsigned seed) {
  std::mt19937 generator(seed);
  std::exponential_distribution<double> chance(1 / kTailScale);
  std::vector<double> values(kOffsets, 0);
  for (std::size_t first = 0; first < kOffsets; first += kNarrowest) {
    const double height = 30 + chance(generator);
    for (std::size_t i = first; i < first + kNarrowest; ++i)
      values[i] = height * std::exp(-std::pow((static_cast<double>(i - first) - 10) / 5, 2));
  }
  return values;
}

TEST(ClockRelation, TheBestOfUnrelatedOffsetsRarelyStandsOut) {
  int claims = 0;
  for (unsigned seed = 0; seed < 500; ++seed)
    claims += chance_of_peak(unrelated_ratios(seed), kNarrowest) < 0.02 ? 1 : 0;
  EXPECT_LE(claims, 20) << "twice the 2 % that the chance promises";
}

TEST(ClockRelation, AnOffsetFarAboveAllRivalsStandsOut) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    std::vector<double> values = unrelated_ratios(seed);
    // 15 scales of the tail: e^-15, with room for a scale that is estimated from 25 maxima.
    values[510] = *std::max_element(values.begin(), values.end()) + 15 * kTailScale;
    EXPECT_LT(chance_of_peak(values, kNarrowest), 1e-3) << "seed " << seed;
  }
}

TEST(ClockRelation, AnOffsetThatRecursWithThePathDoesNotStandOut) {
  std::vector<double> values;
  for (std::size_t i = 0; i < kOffsets; ++i)
    values.push_back(100 * std::pow(std::cos(0.02 * M_PI * static_cast<double>(i)), 8));
  EXPECT_GT(chance_of_peak(values, kNarrowest), 0.5);
}

TEST(ClockRelation, FewRivalsAreNoTest) {
  std::vector<double> values(5 * kNarrowest, 1.0);
  values[50] = 1000;
  EXPECT_EQ(chance_of_peak(values, kNarrowest), 1);
}

}  // namespace
}  // namespace swarmcert::identification
