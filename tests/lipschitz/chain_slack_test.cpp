/// log det S and its derivatives, compared with the definition of S assembled as one dense matrix.
#include "lipschitz/solver/chain_slack.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <atomic>
#include <cmath>

#include "nn/base/random.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

struct Case {
  std::vector<MatrixXd> stages;
  std::vector<double> slopes;
  VectorXd y;
};

/// Returns A_0 and, for each neuron, A_i = -(p_i q_i' + q_i p_i'), from the definition.
std::vector<MatrixXd> constraints(const Case& of) {
  const Index inputs = of.stages.front().cols(), size = inputs + of.y.size() - 1;
  std::vector<MatrixXd> result(1, MatrixXd::Zero(size, size));
  result[0].topLeftCorner(inputs, inputs).setIdentity();
  Index before = 0, begin = inputs;
  for (std::size_t k = 0; k + 1 < of.stages.size(); ++k) {
    const MatrixXd& m = of.stages[k];
    for (Index i = 0; i < m.rows(); ++i) {
      VectorXd e = VectorXd::Unit(size, begin + i), row = VectorXd::Zero(size);
      row.segment(before, m.cols()) = m.row(i).transpose();
      const VectorXd p = e - (1 - of.slopes[k]) * row, q = of.slopes[k] * row - e;
      result.emplace_back(-p * q.transpose() - q * p.transpose());
    }
    before = begin;
    begin += m.rows();
  }
  return result;
}

MatrixXd dense_slack(const Case& of, const VectorXd& y) {
  const std::vector<MatrixXd> a = constraints(of);
  MatrixXd s = MatrixXd::Zero(a[0].rows(), a[0].rows());
  for (Index i = 0; i < y.size(); ++i) s += y(i) * a[static_cast<std::size_t>(i)];
  const MatrixXd& last = of.stages.back();
  s.bottomRightCorner(last.cols(), last.cols()) -= last.transpose() * last;
  return s;
}

/// Returns a chain of these sizes and a point at which S is positive definite: multipliers that grow towards the input.
Case random_case(const std::vector<Index>& sizes, bool is_bent, files::Random& random) {
  Case made;
  Index neurons = 0;
  for (std::size_t k = 1; k < sizes.size(); ++k) {
    MatrixXd m(sizes[k], sizes[k - 1]);
    for (double& x : m.reshaped()) x = random.symmetric() / std::sqrt(static_cast<double>(sizes[k - 1]));
    made.stages.push_back(m);
    if (k + 1 == sizes.size()) break;
    made.slopes.push_back(is_bent ? 1 + random.uniform() / 5 : 1);
    neurons += sizes[k];
  }
  made.y.resize(1 + neurons);
  double level = 1;
  for (Index end = neurons, k = static_cast<Index>(sizes.size()) - 2; k > 0; --k, level *= 4) {
    end -= sizes[static_cast<std::size_t>(k)];
    for (Index i = 0; i < sizes[static_cast<std::size_t>(k)]; ++i)
      made.y(1 + end + i) = level * (1 + random.uniform() / 2);
  }
  made.y(0) = level;
  return made;
}

std::vector<Case> cases() {
  files::Random random(3);
  std::vector<Case> result;
  for (const std::vector<Index>& sizes :
       {std::vector<Index>{3, 5, 2}, {2, 9, 8, 7, 1}, {9, 4, 6, 5}, {1, 6, 6, 6, 6, 6, 9}, {6, 5, 1, 7, 2}})
    for (const bool is_bent : {false, true}) result.push_back(random_case(sizes, is_bent, random));
  return result;
}

TEST(ChainSlack, HasTheDeterminantAndTheGradientOfTheDenseMatrix) {
  for (const Case& each : cases()) {
    const std::optional<ChainPoint> at = chain_point(ChainSlack(each.stages, each.slopes), each.y);
    ASSERT_TRUE(at.has_value());
    const MatrixXd s = dense_slack(each, each.y), inverse = s.inverse();
    EXPECT_NEAR(at->log_determinant, std::log(s.determinant()), 1e-11 * static_cast<double>(s.rows()));
    const std::vector<MatrixXd> a = constraints(each);
    for (std::size_t i = 0; i < a.size(); ++i)
      EXPECT_NEAR(at->gradient(static_cast<Index>(i)), (inverse * a[i]).trace(), 1e-11 * inverse.norm()) << i;
  }
}

TEST(ChainSlack, HasTheHessianOfTheDenseMatrix) {
  for (const Case& each : cases()) {
    const ChainSlack chain(each.stages, each.slopes);
    const MatrixXd h = negative_hessian(chain, *chain_point(chain, each.y), Stop());
    const MatrixXd inverse = dense_slack(each, each.y).inverse();
    const std::vector<MatrixXd> a = constraints(each);
    for (Index i = 0; i < h.rows(); ++i) {
      for (Index j = 0; j <= i; ++j) {
        const double expected =
            (inverse * a[static_cast<std::size_t>(i)] * inverse * a[static_cast<std::size_t>(j)]).trace();
        EXPECT_NEAR(h(i, j), expected, 1e-11 * inverse.squaredNorm()) << i << ", " << j;
      }
    }
  }
}

TEST(ChainSlack, HasNoPointWhereTheMatrixIsIndefinite) {
  for (const Case& each : cases()) {
    const ChainSlack chain(each.stages, each.slopes);
    int definite = 0, tried = 0;
    for (VectorXd y = each.y; y(0) > 1e-3; y *= 0.7, ++tried) {
      const bool is_definite = Eigen::LLT<MatrixXd>(dense_slack(each, y)).info() == Eigen::Success;
      EXPECT_EQ(chain_point(chain, y).has_value(), is_definite) << y(0);
      definite += is_definite ? 1 : 0;
    }
    EXPECT_GT(definite, 0);
    EXPECT_LT(definite, tried);
    VectorXd negative = each.y;
    negative(1) = -1;
    EXPECT_FALSE(chain_point(chain, negative).has_value());
  }
}

TEST(ChainSlack, AStepOfTheLayerwiseBoundInvertsWhatItSays) {
  files::Random random(5);
  const Case made = random_case({7, 6, 4}, false, random);
  const MatrixXd gram = made.stages[0] * made.stages[0].transpose();
  const double t = 0.9 / gram.trace();
  const MatrixXd inner = 2 * t * MatrixXd::Identity(6, 6) - t * t * gram;
  const MatrixXd expected = made.stages[1] * inner.inverse() * made.stages[1].transpose();
  const MatrixXd found = layerwise_gram(made.stages[1], gram, t);
  EXPECT_TRUE(found.triangularView<Eigen::Lower>().toDenseMatrix().isApprox(
      expected.triangularView<Eigen::Lower>().toDenseMatrix(), 1e-12));
  EXPECT_EQ(layerwise_gram(made.stages[1], gram, 3 / gram.diagonal().maxCoeff()).size(), 0);
}

}  // namespace
}  // namespace swarmcert::lipschitz
