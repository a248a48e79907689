/// Factors of block tridiagonal matrices, compared with Eigen's dense factors, and a program solved with them.
#include "lipschitz/solver/block_cholesky.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <random>

#include "lipschitz/solver/lipsdp_solver.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd random_entries(std::mt19937& random, Index rows, Index cols) {
  std::normal_distribution<double> draw;
  MatrixXd m(rows, cols);
  for (Index j = 0; j < cols; ++j)
    for (Index i = 0; i < rows; ++i) m(i, j) = draw(random);
  return m;
}

/// Returns a random symmetric block tridiagonal matrix; `shift` is added to the diagonal.
MatrixXd block_tridiagonal(std::mt19937& random, const std::vector<Index>& begin, double shift) {
  MatrixXd s = MatrixXd::Zero(begin.back(), begin.back());
  for (std::size_t k = 0; k + 1 < begin.size(); ++k) {
    const Index width = begin[k + 1] - begin[k];
    const MatrixXd own = random_entries(random, width, width);
    s.block(begin[k], begin[k], width, width) += own + own.transpose();
    if (k == 0) continue;
    const Index before = begin[k] - begin[k - 1];
    const MatrixXd next = random_entries(random, width, before);
    s.block(begin[k], begin[k - 1], width, before) = next;
    s.block(begin[k - 1], begin[k], before, width) = next.transpose();
  }
  s.diagonal().array() += shift;
  return s;
}

TEST(BlockCholesky, DividesInvertsAndTransformsAsTheDenseFactorDoes) {
  std::mt19937 random(3);
  for (const std::vector<Index>& begin :
       {std::vector<Index>{0, 5}, {0, 3, 4, 9, 11}, {0, 4, 8, 12, 16, 20, 21}}) {
    const Index n = begin.back();
    const MatrixXd s = block_tridiagonal(random, begin, 30);
    const auto factor = BlockCholesky::of(s, begin);
    ASSERT_TRUE(factor);
    const MatrixXd inverse = s.inverse();
    EXPECT_LT((factor->inverse() - inverse).norm(), 1e-14 * static_cast<double>(n));
    MatrixXd x = random_entries(random, 7, n);
    const MatrixXd expected = x * inverse;
    factor->divide(x);
    EXPECT_LT((x - expected).norm(), 1e-13);
    const MatrixXd d = block_tridiagonal(random, begin, 0);
    const VectorXd v = random_entries(random, n, 1);
    const MatrixXd l = s.llt().matrixL();
    const VectorXd transformed = l.inverse() * (d * (l.transpose().inverse() * v));
    EXPECT_LT((factor->congruence_times(d, v) - transformed).norm(), 1e-13);
    EXPECT_GT(transformed.norm(), 1e-3);
  }
}

TEST(BlockCholesky, BreaksDownWhereTheMatrixIsIndefinite) {
  std::mt19937 random(4);
  const std::vector<Index> begin = {0, 4, 8, 12};
  MatrixXd s = block_tridiagonal(random, begin, 30);
  s(9, 9) = -1;
  EXPECT_FALSE(BlockCholesky::of(s, begin));
}

TEST(BlockCholesky, ADeepChainIsSolvedToItsGap) {
  std::mt19937 random(5);
  ReluChain chain;
  for (int k = 0; k <= 14; ++k)
    chain.push_back(random_entries(random, k == 14 ? 2 : 8, k == 0 ? 4 : 8) / std::sqrt(8.0));
  const LipSdpResult result = solve_lipsdp(chain);
  EXPECT_EQ(result.stop, LipSdpStop::kGapReached);
  EXPECT_LT(result.optimum_upper.value(), result.optimum_lower.value() * (1 + 1e-6));
  // No activation pattern has a slope above the bound. With all neurons on, the slope is the norm of the product.
  MatrixXd product = chain.front();
  for (std::size_t k = 1; k < chain.size(); ++k) product = chain[k] * product;
  EXPECT_GE(result.optimum_upper.value(), std::sqrt((product * product.transpose()).trace() / 2));
}

}  // namespace
}  // namespace swarmcert::lipschitz
