#include "lipschitz/branch/descend.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <vector>

#include "lipschitz/dense_kernels.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Weight of log det S_zz beside log det R: keeps S_zz away from singular, where R alone does not see it.
constexpr double kInterior = 0.01;
/// A step is shortened by this until the barrier falls: far from the optimum, where rho is nearly linear along t, Newton's
/// step is far too long.
constexpr double kShorten = 0.3;
constexpr int kShortest = 12;

/// The barrier's root rho for the eigenvalues g of rho I - R: sum 1 / (rho - g_k) = 1 / mu.
double centred_rho(const VectorXd& g, double mu) {
  double low = g.maxCoeff() + mu, high = g.maxCoeff() + static_cast<double>(g.size()) * mu;
  for (int i = 0; i < 60 && low < high; ++i) {
    const double middle = 0.5 * (low + high);
    ((middle - g.array()).inverse().sum() > 1 / mu ? low : high) = middle;
  }
  return high;
}

struct Point {
  VectorXd t;
  MatrixXd factor;  ///< of S_zz; empty: not positive definite
  MatrixXd half;    ///< factor^-1 S_zx
  VectorXd g;       ///< eigenvalues of rho I - R, and their vectors
  MatrixXd vectors;
  double rho = 0, value = 0;

  Point(const NodeInequality& inequality, VectorXd at) : t(std::move(at)) {
    const Index n0 = inequality.inputs(), m = inequality.neurons();
    const MatrixXd s = inequality.slack_without_rho(t);
    factor = cholesky(s.bottomRightCorner(m, m));
    if (factor.size() == 0) return;
    half = s.bottomLeftCorner(m, n0);
    solve_lower(factor, half);
    MatrixXd inner = -s.topLeftCorner(n0, n0);
    inner.noalias() += half.transpose() * half;
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(inner);
    g = eigen.eigenvalues();
    vectors = eigen.eigenvectors();
  }
  void centre(double mu) {
    rho = centred_rho(g, mu);
    value = rho / mu - (rho - g.array()).log().sum() - 2 * kInterior * factor.diagonal().array().log().sum();
  }
  bool good() const { return factor.size() > 0 && g.allFinite(); }
};

/// x' M y for the vectors x and y of all pairs of constraints, where constraint c subtracts t_c (p_c q_c' + q_c p_c').
struct Products {
  MatrixXd pp, pq, qq;  ///< p_c' M p_d, p_c' M q_d, q_c' M q_d
};

/// p_c and q_c as columns of [A E]: a_i and e_i of the neurons, then those of the pairs.
struct Columns {
  std::vector<Index> p, q;
  explicit Columns(const NodeInequality& inequality) {
    const Index m = inequality.neurons();
    for (Index i = 0; i < m; ++i) p.push_back(i), q.push_back(m + i);
    for (const NodeInequality::Factors& pair : inequality.pairs())
      p.push_back(pair.first), q.push_back(pair.second);
  }
  /// @param all [A E]' M [A E].
  Products of(const MatrixXd& all) const { return {all(p, p), all(p, q), all(q, q)}; }
};

/// What gradient and Hessian are made of: S^-1 = S_zz^-1 (padded) + P, P = U U' with U = W R^-1/2 and
/// W = [I; -S_zz^-1 S_zx].
struct Kernel {
  MatrixXd inverse;  ///< [A E]' S_zz^-1 [A E]
  MatrixXd u;        ///< [A E]' U
  VectorXd weights;  ///< eigenvalues of R^-1

  Kernel(const NodeInequality& inequality, const Point& at) {
    const Index n0 = inequality.inputs(), m = inequality.neurons();
    const auto a_x = inequality.a().topRows(n0);
    const auto a_z = inequality.a().bottomRows(m);
    inverse.resize(2 * m, 2 * m);
    inverse.bottomRightCorner(m, m) = inverse_from_cholesky(at.factor);
    inverse.bottomLeftCorner(m, m).setZero();
    add_product(inverse.bottomLeftCorner(m, m), inverse.bottomRightCorner(m, m), a_z);
    inverse.topRightCorner(m, m) = inverse.bottomLeftCorner(m, m).transpose();
    inverse.topLeftCorner(m, m).setZero();
    add_transposed_product(inverse.topLeftCorner(m, m), a_z, inverse.bottomLeftCorner(m, m));
    weights = (at.rho - at.g.array()).inverse().matrix();
    const MatrixXd u_x = at.vectors * weights.cwiseSqrt().asDiagonal();
    MatrixXd u_z = -(at.half * u_x);
    solve_lower_transposed(at.factor, u_z);
    u.resize(2 * m, n0);
    u.bottomRows(m) = u_z;
    u.topRows(m).noalias() = a_x.transpose() * u_x;
    add_transposed_product(u.topRows(m), a_z, u_z);
  }
};

/// Gradient and Hessian of the barrier in t, rho eliminated.
struct Model {
  VectorXd gradient;
  MatrixXd hessian;

  Model(const NodeInequality& inequality, const Point& at) {
    const Kernel kernel(inequality, at);
    const Columns columns(inequality);
    const MatrixXd u_p = kernel.u(columns.p, Eigen::all), u_q = kernel.u(columns.q, Eigen::all);
    const Products x{u_p * u_p.transpose(), u_p * u_q.transpose(), u_q * u_q.transpose()};  // of P
    const Products y = columns.of(kernel.inverse);
    gradient = 2 * (x.pq.diagonal() + kInterior * y.pq.diagonal());
    // tr(X A_i Y A_j) = X_pp o Y_qq + X_qq o Y_pp + X_pq o Y_pq' + X_pq' o Y_pq, for X = P and Y = 2 S_zz^-1 + P, and
    // kInterior times that for X = Y = S_zz^-1.
    hessian = x.pp.cwiseProduct(2 * y.qq + x.qq) + x.qq.cwiseProduct(2 * y.pp + x.pp) +
              2 * kInterior * y.pp.cwiseProduct(y.qq);
    const MatrixXd cross =
        x.pq.cwiseProduct((2 * y.pq + x.pq).transpose()) + kInterior * y.pq.cwiseProduct(y.pq.transpose());
    hessian += cross + cross.transpose();
    const VectorXd edge = -2 * (u_q * kernel.weights.asDiagonal()).cwiseProduct(u_p).rowwise().sum();
    hessian.noalias() -= edge * edge.transpose() / kernel.weights.squaredNorm();
  }

  /// -H^-1 gradient; empty if H is not positive definite. `decrease`: of the quadratic model, twice.
  VectorXd step(double& decrease) {
    const VectorXd scale = hessian.diagonal().cwiseSqrt().cwiseInverse();
    if (!scale.allFinite()) return {};
    hessian = scale.asDiagonal() * hessian * scale.asDiagonal();
    hessian.diagonal().array() += 1e-12;
    const MatrixXd factor = cholesky(hessian);
    if (factor.size() == 0) return {};
    VectorXd result = scale.cwiseProduct(-gradient);
    solve_cholesky(factor, result);
    result = scale.cwiseProduct(result);
    decrease = -gradient.dot(result);
    return result;
  }
};

/// mu for a relative gap at multipliers with the largest eigenvalue g.
double barrier_weight(const NodeInequality& inequality, double g, double relative_gap) {
  return relative_gap * g /
         (static_cast<double>(inequality.inputs()) + kInterior * static_cast<double>(inequality.neurons()));
}

}  // namespace

VectorXd descend(const NodeInequality& inequality, const VectorXd& t, const DescentOptions& options) {
  if (inequality.neurons() == 0) return t;
  Point at(inequality, t);
  if (!at.good()) return t;
  const double before = at.g.maxCoeff();
  for (int i = 0; i < options.steps; ++i) {
    const double mu = barrier_weight(inequality, at.g.maxCoeff(), options.relative_gap);
    if (!(mu > 0)) break;
    at.centre(mu);
    double decrease = 0;
    const VectorXd step = Model(inequality, at).step(decrease);
    if (step.size() == 0 || !(decrease * mu > 0.1 * options.relative_gap * at.rho)) break;
    bool is_better = false;
    double length = 1;
    for (int tries = 0; !is_better && tries < kShortest; ++tries, length *= kShorten) {
      Point next(inequality, at.t + length * step);
      if (!next.good()) continue;
      next.centre(mu);
      is_better = next.value < at.value;
      if (is_better) at = std::move(next);
    }
    if (!is_better) break;
  }
  return at.g.maxCoeff() < before ? at.t : t;
}

std::vector<double> gains(const NodeInequality& inequality, const VectorXd& t, double relative_gap) {
  std::vector<double> result(inequality.pairs().size(), 0.0);
  if (inequality.neurons() == 0) return result;
  Point at(inequality, t);
  if (!at.good()) return result;
  const double mu = barrier_weight(inequality, at.g.maxCoeff(), relative_gap);
  if (!(mu > 0)) return result;
  at.centre(mu);
  const Kernel kernel(inequality, at);
  for (std::size_t c = 0; c < result.size(); ++c) {
    const auto [p, q] = inequality.pairs()[c];
    const auto u_p = kernel.u.row(p), u_q = kernel.u.row(q);
    const double pp = u_p.squaredNorm(), pq = u_p.dot(u_q), qq = u_q.squaredNorm();
    const double i_pp = kernel.inverse(p, p), i_pq = kernel.inverse(p, q), i_qq = kernel.inverse(q, q);
    const double gradient = 2 * (pq + kInterior * i_pq);
    const double curvature = 2 * (pp * i_qq + qq * i_pp + pp * qq + 2 * pq * i_pq + pq * pq) +
                             2 * kInterior * (i_pp * i_qq + i_pq * i_pq);
    if (curvature > 0) result[c] = gradient * gradient / curvature;
  }
  return result;
}

}  // namespace swarmcert::lipschitz
