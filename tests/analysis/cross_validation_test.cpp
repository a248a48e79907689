#include "analysis/identification/cross_validation.h"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "nn/base/doubles.h"
#include "nn/base/random.h"

namespace swarmcert::identification {
namespace {

constexpr int kColumns = 4, kRecords = 40;
constexpr double kNoise_N = 0.1;

Candidate one_column(const std::string& name, double lower = -kInfinity, double upper = kInfinity) {
  Candidate candidate;
  candidate.name = name;
  candidate.info.linear = {{"size_N", "", 0, lower, upper}};
  candidate.thetas = {{}};
  return candidate;
}

/// Blocks of random columns and residuals: 2 times column 0, 0.5 times column 1, and white noise.
class Blocks {
 public:
  explicit Blocks(int count, int flights = 1) {
    grams = columns_of(
        {one_column("large"), one_column("small"), one_column("absent"), one_column("bounded", 0, 0.1)});
    for (auto& support : grams.support) support = {{1000, 10, flights}};
    x.resize(Eigen::Index(3) * kRecords * count, kColumns);
    y.resize(x.rows());
    files::Random random(3);
    for (double& value : x.reshaped()) value = random.symmetric();
    for (Eigen::Index i = 0; i < y.size(); ++i)
      y[i] = 2 * x(i, 0) + 0.5 * x(i, 1) + kNoise_N * std::sqrt(3.0) * random.symmetric();
    for (int k = 0; k < count; ++k) {
      const auto rows = x.middleRows(Eigen::Index(3) * kRecords * k, 3 * kRecords);
      const auto left = y.segment(Eigen::Index(3) * kRecords * k, 3 * kRecords);
      Block block;
      block.gram.resize(kColumns * (kColumns + 1) / 2);
      for (int j = 0; j < kColumns; ++j) {
        for (int i = 0; i <= j; ++i) block.gram[Grams::packed(i, j)] = rows.col(i).dot(rows.col(j));
      }
      block.b = rows.transpose() * left;
      block.y = left.squaredNorm();
      block.records = kRecords;
      block.flight = k * flights / count;
      grams.blocks.push_back(std::move(block));
    }
  }

  Grams grams;
  Eigen::MatrixXd x;
  Eigen::VectorXd y;
};

const Members kTruth = {{0, 0}, {1, 0}};

TEST(CrossValidation, CoefficientsAreThoseOfLeastSquaresOverAllRecords) {
  const Blocks blocks(30);
  const CrossValidation validation(blocks.grams);
  const Eigen::VectorXd direct = blocks.x.leftCols(3).colPivHouseholderQr().solve(blocks.y);
  const Eigen::VectorXd found = validation.coefficients({{0, 0}, {1, 0}, {2, 0}});
  EXPECT_LT((found - direct).norm(), 1e-9);
}

TEST(CrossValidation, CoefficientsStayWithinTheirBounds) {
  Blocks blocks(30);
  for (const double slope : {-1.0, 0.05, 1.0}) {
    for (Block& block : blocks.grams.blocks) block.b[3] = slope * block.gram[Grams::packed(3, 3)];
    EXPECT_NEAR(CrossValidation(blocks.grams).coefficients({{3, 0}})[0], std::clamp(slope, 0.0, 0.1), 1e-9);
  }
}

TEST(CrossValidation, ErrorOfHeldOutBlocksIsTheNoiseForTheTruthAndNotBelowItForMore) {
  const Blocks blocks(100);
  const CrossValidation validation(blocks.grams);
  const double noise = 3 * kNoise_N * kNoise_N;  // three axes
  EXPECT_NEAR(validation.mean_square({}), blocks.y.squaredNorm() / (100.0 * kRecords), 1e-9);
  EXPECT_NEAR(validation.mean_square(kTruth), noise, 0.05 * noise);
  EXPECT_GT(validation.mean_square({{0, 0}}), 1.5 * noise);
  EXPECT_GT(validation.mean_square(with(kTruth, {2, 0})), validation.mean_square(kTruth) * (1 - 1e-3));
}

TEST(CrossValidation, BlockErrorsAddUpToTheMeanSquare) {
  for (const int flights : {1, 10}) {
    const Blocks blocks(60, flights);
    const CrossValidation validation(blocks.grams);
    const std::vector<double> errors = validation.block_errors(kTruth);
    ASSERT_EQ(errors.size(), 60u);
    EXPECT_NEAR(std::accumulate(errors.begin(), errors.end(), 0.0) / (60.0 * kRecords),
                validation.mean_square(kTruth), 1e-12);
  }
}

/// One flight differs from the others: if it is left out as a whole, its blocks cannot influence the fit judged on it.
TEST(CrossValidation, WholeFlightsAreLeftOutWhereThereAreFive) {
  Blocks blocks(50, 5);
  for (Block& block : blocks.grams.blocks) {
    if (block.flight == 0) block.b[2] += 100;
  }
  const CrossValidation validation(blocks.grams);
  const std::vector<Eigen::VectorXd> fits = validation.fold_coefficients({{2, 0}});
  int without = 0;
  for (const Eigen::VectorXd& fit : fits) without += std::abs(fit[0]) < 0.2 ? 1 : 0;
  EXPECT_EQ(without, 1) << "exactly the fit without that flight knows nothing of it";
}

TEST(CrossValidation, AnEffectOfOneFlightIsJudgedOnBlocks) {
  Blocks blocks(50, 5);
  blocks.grams.support[2] = {{1000, 10, 1}};
  for (Block& block : blocks.grams.blocks) {
    if (block.flight == 0) block.b[2] += 100;
  }
  const CrossValidation validation(blocks.grams);
  for (const Eigen::VectorXd& fit : validation.fold_coefficients({{2, 0}})) EXPECT_GT(std::abs(fit[0]), 0.2);
}

}  // namespace
}  // namespace swarmcert::identification
