// The kernels of the interior-point method give the same bits on every thread.
#include "lipschitz/solver/dense_kernels.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>
#include <vector>

namespace swarmcert::lipschitz {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Calls every kernel once, with well-conditioned matrices.
MatrixXd through_all_kernels(const MatrixXd& a) {
  const Eigen::Index n = a.rows();
  MatrixXd x = n * MatrixXd::Identity(n, n);
  add_product_transposed(x, a, a);
  const MatrixXd factor = cholesky(x);
  MatrixXd result = inverse_from_cholesky(factor);
  add_product(result, a, x);
  add_transposed_product(result, a, result.eval());
  solve_lower(factor, result);
  solve_lower_transposed(factor, result);
  VectorXd column = result.col(0);
  solve_cholesky(factor, column);
  result.col(1) = column;
  result.col(2) = congruence_times(factor, x, column);
  add_symmetric_product(column, 0.5, x, result.col(2));
  result.col(0) = column;
  return result;
}

TEST(DenseKernels, ThreadsThatWorkAtTheSameTimeGetTheBitsOfOneAlone) {
  use_one_blas_thread();
  constexpr int kThreads = 4, kRounds = 300;
  std::atomic<int> different{0};
  std::vector<std::thread> threads;
  for (int i = 0; i < kThreads; ++i) {
    const MatrixXd matrix = MatrixXd::Random(70, 70);
    threads.emplace_back([&different, matrix, alone = through_all_kernels(matrix)] {
      for (int round = 0; round < kRounds; ++round) different += through_all_kernels(matrix) == alone ? 0 : 1;
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(different, 0) << "of " << kThreads * kRounds;
}

/// Returns Q diag(values) Q' for an orthogonal Q composed of many reflections.
MatrixXd with_eigenvalues(const VectorXd& values) {
  MatrixXd m = values.asDiagonal();
  for (int i = 0; i < 20; ++i) {
    const VectorXd v = VectorXd::Random(values.size()).normalized();
    m -= 2 * v * (v.transpose() * m);
    m -= 2 * (m * v) * v.transpose();
  }
  return m;
}

TEST(DenseKernels, FindTheLargestEigenvalueOfMatricesOfKnownOnes) {
  for (const Eigen::Index n : {1, 10, 64, 65, 90, 300}) {
    const VectorXd spread = VectorXd::LinSpaced(n, 0, 3);
    VectorXd twice = spread, close = spread;
    twice(0) = 3;
    close(0) = 3 * (1 - 1e-7);
    for (const VectorXd& values : {spread, twice, close, VectorXd(VectorXd::Constant(n, 2)),
                                   VectorXd(5 * VectorXd::Unit(n, n / 2)), VectorXd(VectorXd::Zero(n))}) {
      MatrixXd m = with_eigenvalues(values);
      m.triangularView<Eigen::StrictlyUpper>().setConstant(99);  // must not be read
      EXPECT_NEAR(largest_eigenvalue(m), values.maxCoeff(), 1e-12 * values.maxCoeff()) << n;
    }
  }
}

}  // namespace
}  // namespace swarmcert::lipschitz
