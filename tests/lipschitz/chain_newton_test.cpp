#include "lipschitz/solver/chain_newton.h"

#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <atomic>
#include <cmath>

#include "lipschitz/upper/lmi_proof.h"
#include "nn/base/random.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kGap = 1e-6;  ///< the relative gap for which minimise_chain() is meant

InteriorPointOptions options() {
  InteriorPointOptions options;
  options.relative_gap = kGap;
  options.max_iterations = 200;
  return options;
}

double best_rho(const std::vector<MatrixXd>& stages) {
  const InteriorPointResult found = minimise_chain(ChainSlack(stages), options());
  EXPECT_EQ(found.stop, LipSdpStop::kGapReached) << name(found.stop);
  return found.points.back()(0);
}

/// Neurons that share neither input nor output: the Lipschitz constant is the largest slope of a neuron, and LipSDP
/// attains it.
TEST(ChainNewton, ReachesTheSteepestOfSeparateNeurons) {
  files::Random random(4);
  for (const int size : {3, 20, 60}) {
    VectorXd first(size), last(size);
    for (int i = 0; i < size; ++i)
      first[i] = 1 + random.symmetric() / 2, last[i] = 1 + random.symmetric() / 2;
    const double steepest = first.cwiseProduct(last).maxCoeff();
    const double rho = best_rho({first.asDiagonal(), last.asDiagonal()});
    EXPECT_NEAR(std::sqrt(rho), steepest, 2 * kGap * steepest) << size;
  }
}

TEST(ChainNewton, StaysAboveEveryLinearRegionAndBelowTheProductOfNorms) {
  files::Random random(9);
  int attained = 0;
  for (int run = 0; run < 10; ++run) {
    std::vector<MatrixXd> stages;
    for (const auto& [rows, columns] : {std::pair(8, 4), {8, 8}, {3, 8}}) {
      MatrixXd m(rows, columns);
      for (double& x : m.reshaped()) x = random.symmetric() / 2;
      stages.push_back(m);
    }
    const double bound = std::sqrt(best_rho(stages));
    double product = 1, steepest = 0;
    for (const MatrixXd& m : stages) product *= m.jacobiSvd().singularValues()[0];
    for (int pattern = 0; pattern < 2000; ++pattern) {
      MatrixXd slope = stages[0];
      for (std::size_t k = 1; k < stages.size(); ++k) {
        for (Eigen::Index i = 0; i < slope.rows(); ++i) slope.row(i) *= random.symmetric() < 0.3 ? 1 : 0;
        slope = stages[k] * slope;
      }
      steepest = std::max(steepest, slope.jacobiSvd().singularValues()[0]);
    }
    EXPECT_LE(steepest, bound * (1 + kGap));
    EXPECT_LE(bound, product * (1 + kGap));
    attained += steepest > 0.6 * bound ? 1 : 0;
  }
  EXPECT_GT(attained, 5);  // some activation patterns come close to the bound
}

TEST(ChainNewton, ItsMultipliersAreProvedAndThoseOfASmallerRhoAreNot) {
  files::Random random(2);
  std::vector<MatrixXd> stages;
  std::vector<check::Matrix> exact;
  for (const auto& [rows, columns] : {std::pair(6, 3), {6, 6}, {2, 6}}) {
    MatrixXd m(rows, columns);
    check::Matrix dyadic(rows, columns);
    for (int i = 0; i < rows; ++i) {
      for (int j = 0; j < columns; ++j) {
        m(i, j) = random.symmetric();
        dyadic(i, j) = check::Dyadic(m(i, j));
      }
    }
    stages.push_back(m);
    exact.push_back(dyadic);
  }
  const VectorXd y = minimise_chain(ChainSlack(stages), options()).points.back();
  const std::vector<double> t(y.data() + 1, y.data() + y.size());
  EXPECT_TRUE(prove(exact, y(0) * (1 + 1e-8), t));
  EXPECT_FALSE(prove(exact, y(0) * (1 - 1e-4), t));
}

TEST(ChainNewton, EndsAtOnceWhereItIsCancelled) {
  InteriorPointOptions none = options();
  const std::atomic<bool> cancelled{true};
  none.stop = Stop(&cancelled);
  const std::vector<MatrixXd> stages(2, MatrixXd::Identity(5, 5));
  const InteriorPointResult found = minimise_chain(ChainSlack(stages), none);
  EXPECT_EQ(found.stop, LipSdpStop::kCancelled);
  EXPECT_EQ(found.iterations, 0);
}

}  // namespace
}  // namespace swarmcert::lipschitz
