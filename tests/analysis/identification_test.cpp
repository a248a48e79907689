#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "analysis/identification/box_least_squares.h"
#include "analysis/identification/covariance.h"
#include "analysis/identification/verdict.h"
#include "stability/effects/registry.h"

namespace swarmcert::identification {
namespace {

TEST(BoxLeastSquares, MeetsTheConditionsOfAnOptimumWithinBounds) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> bell;
  int at_bounds = 0, free = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const int n = 1 + trial % 6;
    Eigen::MatrixXd x(20, n);
    Eigen::VectorXd r(20), lower(n), upper(n);
    for (int i = 0; i < 20; ++i) {
      for (int j = 0; j < n; ++j) x(i, j) = bell(random);
      r[i] = bell(random);
    }
    for (int j = 0; j < n; ++j) {
      lower[j] = -0.2 * std::abs(bell(random));
      upper[j] = 0.2 * std::abs(bell(random));
    }
    const Eigen::MatrixXd gram = x.transpose() * x;
    const Eigen::VectorXd b = x.transpose() * r;
    const Eigen::VectorXd c = box_least_squares(gram, b, lower, upper);
    const Eigen::VectorXd downhill = b - gram * c;
    for (int j = 0; j < n; ++j) {
      ASSERT_GE(c[j], lower[j]);
      ASSERT_LE(c[j], upper[j]);
      const double tolerance = 1e-6 * (1 + b.norm());
      if (c[j] == lower[j]) {
        EXPECT_LE(downhill[j], tolerance);
        ++at_bounds;
      } else if (c[j] == upper[j]) {
        EXPECT_GE(downhill[j], -tolerance);
        ++at_bounds;
      } else {
        EXPECT_NEAR(downhill[j], 0, tolerance);
        ++free;
      }
    }
  }
  EXPECT_GT(at_bounds, 50);
  EXPECT_GT(free, 50);
}

/// Forty blocks of white noise; the column of the only candidate is as random as the residual.
struct WhiteNoise {
  static constexpr int kBlocks = 40, kRows = 600;
  std::vector<Eigen::VectorXd> column, residual;
  Candidate candidate;

  WhiteNoise() {
    std::mt19937_64 random(2);
    std::normal_distribution<double> bell;
    for (int k = 0; k < kBlocks; ++k) {
      column.emplace_back(kRows);
      residual.emplace_back(kRows);
      for (int i = 0; i < kRows; ++i) {
        column.back()[i] = bell(random);
        residual.back()[i] = 0.01 * bell(random);
      }
    }
    candidate.name = candidate.spec.name = "drag_linear";
    candidate.info = stability::effect_info("drag_linear");
    candidate.thetas = {{}};
  }
  /// Adds `size` times the column to the residual.
  Grams grams(double size) const {
    Grams result;
    result.candidates = {candidate};
    result.first_column = {{0}};
    result.support = {{{10'000, 40, 1}}};
    result.columns = 1;
    for (std::size_t k = 0; k < column.size(); ++k) {
      const Eigen::VectorXd r = residual[k] + size * column[k];
      Block block;
      block.gram = Eigen::VectorXd::Constant(1, column[k].squaredNorm());
      block.b = Eigen::VectorXd::Constant(1, column[k].dot(r));
      block.y = r.squaredNorm();
      block.records = kRows / 3;
      result.blocks.push_back(block);
    }
    return result;
  }
};

/// A first-order process, whose mean has the variance (1 + rho) / (1 - rho) / n for long series. Blocks hold its
/// values minus their mean, like residuals of a fit.
TEST(LongRunVariance, IsThatOfTheMeanOfACorrelatedProcess) {
  constexpr int kValues = 40, kSeries = 2000;
  std::mt19937_64 random(3);
  std::normal_distribution<double> bell;
  for (const double rho : {0.0, 0.3, 0.6}) {
    double estimated = 0, squared_means = 0;
    for (int series = 0; series < kSeries; ++series) {
      std::vector<double> values;
      double x = bell(random);
      for (int i = 0; i < kValues; ++i) {
        values.push_back(x);
        x = rho * x + std::sqrt(1 - rho * rho) * bell(random);
      }
      double mean = 0;
      for (const double value : values) mean += value / kValues;
      squared_means += mean * mean;
      for (double& value : values) value = (value - mean) / (kValues - 1);
      estimated += long_run_variance(values, std::vector<char>(kValues, 1));
    }
    // Too large by 10 % or more, because negative correlations are ignored; never too small.
    EXPECT_GT(estimated, 0.95 * squared_means) << rho;
    EXPECT_LT(estimated, 1.6 * squared_means) << rho;
  }
  const std::vector<double> alike(kValues, 1);
  EXPECT_EQ(long_run_variance(alike, std::vector<char>(kValues, 0)), kValues)
      << "blocks that do not follow each other are independent";
}

TEST(Jackknife, IsTheVarianceOfWhiteNoiseAndKnowsWhenFewBlocksTell) {
  const WhiteNoise noise;
  Grams grams = noise.grams(0);
  double energy = 0, product = 0;
  for (const Block& block : grams.blocks) {
    energy += block.gram[0];
    product += block.b[0];
  }
  const Eigen::VectorXd c = Eigen::VectorXd::Constant(1, product / energy);
  const double white = 0.01 * 0.01 / energy;
  const Jackknife even = jackknife(grams.blocks, {0}, c);
  EXPECT_NEAR(even.variance[0], white, 0.5 * white);  // 40 blocks: 22 % standard error
  EXPECT_GT(even.freedom[0], 35);
  // Four of 40 blocks carry information.
  for (std::size_t k = 4; k < grams.blocks.size(); ++k) {
    grams.blocks[k].gram[0] = 0;
    grams.blocks[k].b[0] = 0;
  }
  energy = product = 0;
  for (const Block& block : grams.blocks) {
    energy += block.gram[0];
    product += block.b[0];
  }
  const Eigen::VectorXd few = Eigen::VectorXd::Constant(1, product / energy);
  EXPECT_NEAR(jackknife(grams.blocks, {0}, few).freedom[0], 3, 0.1);
  EXPECT_GT(jackknife(grams.blocks, {0}, few).variance[0], sandwich(grams.blocks, {0}, few)(0, 0));
}

TEST(Sandwich, IsTheVarianceOfWhiteNoiseAndGrowsWhereBlocksAreAlike) {
  const WhiteNoise noise;
  const Grams grams = noise.grams(0);
  double energy = 0, product = 0;
  for (const Block& block : grams.blocks) {
    energy += block.gram[0];
    product += block.b[0];
  }
  const Eigen::VectorXd c = Eigen::VectorXd::Constant(1, product / energy);
  const double white = 0.01 * 0.01 / energy;
  EXPECT_NEAR(sandwich(grams.blocks, {0}, c)(0, 0), white, 0.5 * white);  // 40 blocks: 22 % standard error
  // Each block twice: the same information is counted twice, where the second block follows the first.
  std::vector<Block> twice;
  for (const Block& block : grams.blocks) {
    twice.push_back(block);
    twice.push_back(block);
    twice.back().follows = true;
  }
  EXPECT_GT(sandwich(twice, {0}, c)(0, 0), 0.7 * sandwich(grams.blocks, {0}, c)(0, 0));
  for (Block& block : twice) block.follows = false;
  EXPECT_LT(sandwich(twice, {0}, c)(0, 0), 0.6 * sandwich(grams.blocks, {0}, c)(0, 0));
}

Diagnosis judged(bool names_an_effect, double ratio) {
  Diagnosis diagnosis;
  diagnosis.kind = "small";
  if (names_an_effect) diagnosis.ranking.emplace_back();
  diagnosis.remainder.ratio = ratio;
  diagnosis.remainder.flag = ratio > 3;
  return diagnosis;
}

TEST(Verdict, IsNothingMissingOnlyWhereEveryKindWasJudgedAndNothingIsLeft) {
  std::string reason;
  EXPECT_EQ(verdict_of({judged(false, 1.5)}, reason), Verdict::kNothingMissing);
  EXPECT_EQ(reason, "");
  EXPECT_EQ(verdict_of({judged(false, 40)}, reason), Verdict::kUnexplained);
  EXPECT_EQ(verdict_of({judged(true, 40)}, reason), Verdict::kMissingEffect);
  EXPECT_EQ(verdict_of({judged(false, 1.5), judged(true, 1.5)}, reason), Verdict::kMissingEffect);
  EXPECT_EQ(verdict_of({judged(false, 1.5), judged(false, 4)}, reason), Verdict::kUnexplained);
  Diagnosis poor;
  poor.kind = "large";
  poor.too_poor = "12 usable records";
  EXPECT_EQ(verdict_of({judged(false, 1.5), poor}, reason), Verdict::kInconclusive);
  EXPECT_EQ(reason, "vehicles of kind large: 12 usable records");
  EXPECT_EQ(verdict_of({judged(false, 40), poor}, reason), Verdict::kUnexplained);
  EXPECT_EQ(verdict_of({judged(false, 0)}, reason), Verdict::kInconclusive)
      << "what is left could not be judged";
  EXPECT_NE(reason.find("no spectrum"), std::string::npos);
  EXPECT_EQ(verdict_of({}, reason), Verdict::kInconclusive);
  EXPECT_STREQ(name(Verdict::kMissingEffect), "missing_effect");
  EXPECT_STREQ(name(Verdict::kUnexplained), "unexplained");
  EXPECT_STREQ(name(Verdict::kNothingMissing), "nothing_missing");
  EXPECT_STREQ(name(Verdict::kInconclusive), "inconclusive");
}

}  // namespace
}  // namespace swarmcert::identification
