#include "analysis/identification/box_least_squares.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <vector>

namespace swarmcert::identification {
namespace {

/// Keeps coefficients at their bounds fixed and minimises over the free ones.
void solve_free(const Eigen::MatrixXd& gram, const Eigen::VectorXd& b, const std::vector<int>& state,
                const std::vector<int>& free, Eigen::VectorXd& c) {
  if (free.empty()) return;
  const auto m = static_cast<int>(free.size());
  Eigen::MatrixXd g(m, m);
  Eigen::VectorXd rhs(m);
  for (int i = 0; i < m; ++i) {
    const int fi = free[static_cast<std::size_t>(i)];
    rhs[i] = b[fi];
    for (int k = 0; k < static_cast<int>(b.size()); ++k) {
      if (state[static_cast<std::size_t>(k)] != 0) rhs[i] -= gram(fi, k) * c[k];
    }
    for (int j = 0; j < m; ++j) g(i, j) = gram(fi, free[static_cast<std::size_t>(j)]);
    g(i, i) += 1e-10 * gram(fi, fi) + 1e-18;
  }
  const Eigen::VectorXd solution = g.ldlt().solve(rhs);
  for (int i = 0; i < m; ++i) c[free[static_cast<std::size_t>(i)]] = solution[i];
}

}  // namespace

Eigen::VectorXd box_least_squares(const Eigen::MatrixXd& gram, const Eigen::VectorXd& b,
                                  const Eigen::VectorXd& lower, const Eigen::VectorXd& upper) {
  const auto n = static_cast<int>(b.size());
  std::vector<int> state(static_cast<std::size_t>(n), 0);  // -1, 0, 1: at lower bound, free, at upper bound
  for (int i = 0; i < n; ++i) {
    if (lower[i] == upper[i]) state[static_cast<std::size_t>(i)] = -1;
  }
  Eigen::VectorXd c = Eigen::VectorXd::Zero(n);
  for (int pass = 0; pass < 6 * n + 6; ++pass) {
    std::vector<int> free;
    for (int i = 0; i < n; ++i) {
      const int s = state[static_cast<std::size_t>(i)];
      if (s == 0)
        free.push_back(i);
      else
        c[i] = s < 0 ? lower[i] : upper[i];
    }
    solve_free(gram, b, state, free, c);
    int worst = -1;
    double most = 0;
    for (const int i : free) {
      const double scale = std::sqrt(std::max(gram(i, i), 0.0));
      const double beyond = scale * std::max(lower[i] - c[i], c[i] - upper[i]);
      if (beyond > most) {
        most = beyond;
        worst = i;
      }
    }
    if (worst >= 0) {
      state[static_cast<std::size_t>(worst)] = c[worst] < lower[worst] ? -1 : 1;
      continue;
    }
    const Eigen::VectorXd gradient = b - gram * c;
    most = 1e-9 * std::abs(b.cwiseAbs().maxCoeff());
    for (int i = 0; i < n; ++i) {
      const int s = lower[i] == upper[i] ? 0 : state[static_cast<std::size_t>(i)];
      const double inside = s < 0 ? gradient[i] : s > 0 ? -gradient[i] : 0;
      if (inside > most) {
        most = inside;
        worst = i;
      }
    }
    if (worst < 0) break;
    state[static_cast<std::size_t>(worst)] = 0;
  }
  return c.cwiseMax(lower).cwiseMin(upper);
}

}  // namespace swarmcert::identification
