#include "analysis/identification/covariance.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace swarmcert::identification {
namespace {

std::vector<int> every_column(Eigen::Index count) {
  std::vector<int> all;
  for (int i = 0; i < count; ++i) all.push_back(i);
  return all;
}

/// Returns the regularised sum of the blocks' G over `free`.
Eigen::MatrixXd sum_of_grams(const std::vector<Block>& blocks, const std::vector<int>& free,
                             const Eigen::VectorXd& ridge) {
  const auto n = static_cast<Eigen::Index>(free.size());
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(n, n);
  for (const Block& block : blocks) sum += part_of_gram(block.gram, free);
  for (Eigen::Index i = 0; i < n; ++i) {
    sum(i, i) += 1e-10 * sum(i, i) + 1e-18;
    if (ridge.size() > 0) sum(i, i) += ridge[free[static_cast<std::size_t>(i)]];
  }
  return sum;
}

}  // namespace

Eigen::MatrixXd sandwich(const std::vector<Block>& blocks, const std::vector<int>& free,
                         const Eigen::VectorXd& c, const Eigen::VectorXd& ridge) {
  const auto n = static_cast<Eigen::Index>(free.size());
  const std::vector<int> all = every_column(c.size());
  Eigen::MatrixXd meat = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd last = Eigen::VectorXd::Zero(n);
  for (const Block& block : blocks) {
    const Eigen::VectorXd score = part_of(block.b - part_of_gram(block.gram, all) * c, free);
    meat += score * score.transpose();
    if (block.follows) meat += 0.5 * (score * last.transpose() + last * score.transpose());
    last = score;
  }
  const Eigen::MatrixXd inverse =
      sum_of_grams(blocks, free, ridge).ldlt().solve(Eigen::MatrixXd::Identity(n, n));
  const auto count = static_cast<double>(blocks.size());
  const Eigen::MatrixXd inner =
      inverse * meat * inverse * (count / std::max(1.0, count - static_cast<double>(n)));
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(c.size(), c.size());
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j)
      covariance(free[static_cast<std::size_t>(i)], free[static_cast<std::size_t>(j)]) = inner(i, j);
  }
  return covariance;
}

double long_run_variance(const std::vector<double>& influences, const std::vector<char>& follows) {
  constexpr double kMostCorrelation = 0.7;  // above it, blocks of this length are too short
  constexpr double kFewestPairs = 4;
  double squares = 0, products = 0, pairs = 0;
  for (std::size_t i = 0; i < influences.size(); ++i) {
    squares += influences[i] * influences[i];
    if (i == 0 || follows[i] == 0) continue;
    products += influences[i] * influences[i - 1];
    pairs += 1;
  }
  if (pairs < kFewestPairs || squares <= 0) return squares;
  const double seen = products / pairs / (squares / static_cast<double>(influences.size()));
  const double rho = std::clamp((pairs * seen + 1) / (pairs - 3), 0.0, kMostCorrelation);
  return squares * (1 + rho) / (1 - rho);
}

Jackknife jackknife(const std::vector<Block>& blocks, const std::vector<int>& free, const Eigen::VectorXd& c,
                    const Eigen::VectorXd& ridge) {
  const auto n = static_cast<Eigen::Index>(free.size());
  const std::vector<int> all = every_column(c.size());
  const Eigen::MatrixXd sum = sum_of_grams(blocks, free, ridge);
  const Eigen::MatrixXd inverse = sum.ldlt().solve(Eigen::MatrixXd::Identity(n, n));
  // Limits the leverage of a block: without a block that alone determines a coefficient, the coefficient would be
  // infinitely uncertain.
  constexpr double kOthers = 0.98;
  Eigen::VectorXd weights = Eigen::VectorXd::Zero(n), squared_weights = weights;
  std::vector<std::vector<double>> influences(free.size());
  std::vector<char> follows;
  for (const Block& block : blocks) {
    const Eigen::VectorXd score = part_of(block.b - part_of_gram(block.gram, all) * c, free);
    const Eigen::MatrixXd own = part_of_gram(block.gram, free);
    const Eigen::VectorXd influence = (sum - kOthers * own).ldlt().solve(score);
    for (Eigen::Index i = 0; i < n; ++i) influences[static_cast<std::size_t>(i)].push_back(influence[i]);
    follows.push_back(block.follows ? 1 : 0);
    const Eigen::VectorXd weight = (inverse * own * inverse).diagonal().cwiseMax(0);
    weights += weight;
    squared_weights += weight.cwiseAbs2();
  }
  Jackknife result{Eigen::VectorXd::Zero(c.size()), Eigen::VectorXd::Ones(c.size())};
  for (Eigen::Index i = 0; i < n; ++i) {
    const int column = free[static_cast<std::size_t>(i)];
    result.variance[column] = long_run_variance(influences[static_cast<std::size_t>(i)], follows);
    if (squared_weights[i] > 0)
      result.freedom[column] = std::max(1.0, weights[i] * weights[i] / squared_weights[i] - 1);
  }
  return result;
}

double paired_z(const std::vector<double>& before, const std::vector<double>& after) {
  const auto n = static_cast<double>(before.size());
  double sum = 0, squares = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    const double d = before[i] - after[i];
    sum += d;
    squares += d * d;
  }
  const double variance = squares / n - (sum / n) * (sum / n);
  return variance > 0 ? sum / n / std::sqrt(variance / n) : 0;
}

}  // namespace swarmcert::identification
