#include "lipschitz/branch/descend.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <vector>

#include "lipschitz/solver/dense_kernels.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Weight of log det S_zz relative to log det R. It keeps S_zz away from singularity, which log det R alone does not.
constexpr double kInterior = 0.01;
/// A step is shortened by this factor until the barrier decreases: far from the optimum, where rho is nearly linear in
/// t, the Newton step is much too long.
constexpr double kShorten = 0.3;
constexpr int kShortest = 12;

/// Returns the rho that minimises the barrier for the eigenvalues g of rho I - R: sum 1 / (rho - g_k) = 1 / mu.
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
  MatrixXd factor;  ///< Cholesky factor of S_zz (lower triangle); empty: not positive definite
  MatrixXd half;    ///< factor^-1 S_zx
  VectorXd g;       ///< eigenvalues of rho I - R; `vectors` are the eigenvectors
  MatrixXd vectors;
  double rho = 0, value = 0;

  Point(const NodeInequality& inequality, VectorXd at) : t(std::move(at)) {
    const Index n0 = inequality.inputs(), m = inequality.neurons();
    const MatrixXd s = inequality.slack_without_rho(t);
    factor = s.bottomRightCorner(m, m);
    if (!cholesky_in_place(factor)) {
      factor.resize(0, 0);
      return;
    }
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

/// The products x' M y of the vectors p and q of all constraints; constraint c subtracts t_c (p_c q_c' + q_c p_c').
struct Products {
  MatrixXd pp;  ///< p_c' M p_d, in the lower triangle
  MatrixXd qp;  ///< q_c' M p_d
  MatrixXd pq;  ///< transpose of qp
  MatrixXd qq;  ///< q_c' M q_d

  /// M += U U', for p_c' U and q_c' U.
  void add(const MatrixXd& u_p, const MatrixXd& u_q) {
    add_product_transposed(pp, u_p, u_p);
    add_product_transposed(qp, u_q, u_p);
    add_product_transposed(pq, u_p, u_q);
    add_product_transposed(qq, u_q, u_q);
  }
  /// H += factor (pp o qq + pq o qp) in the lower triangle.
  void add_to(MatrixXd& hessian, double factor) const {
    for (Index c = 0; c < hessian.cols(); ++c) {
      const Index rows = hessian.rows() - c;
      hessian.col(c).tail(rows) += factor * (pp.col(c).tail(rows).cwiseProduct(qq.col(c).tail(rows)) +
                                             pq.col(c).tail(rows).cwiseProduct(qp.col(c).tail(rows)));
    }
  }
};

/// The products for gradient and Hessian: S^-1 = S_zz^-1 (padded) + P, P = U U' with U = W R^-1/2 and
/// W = [I; -S_zz^-1 S_zx]. For a neuron, p = a_i and q = e_i; for a pair, p and q are a_i or e_i of its two neurons.
struct Kernel {
  Products inverse;   ///< M = S_zz^-1
  MatrixXd u_p, u_q;  ///< p_c' U, q_c' U
  VectorXd weights;   ///< eigenvalues of R^-1

  Kernel(const NodeInequality& inequality, const Point& at) {
    const Index n0 = inequality.inputs(), m = inequality.neurons();
    inverse.qq = at.factor;
    invert_from_cholesky(inverse.qq);
    inverse.qp.resize(m, m);
    for (const NodeInequality::LayerBlock& block : inequality.blocks()) {
      auto columns = inverse.qp.middleCols(block.first_neuron, block.neurons);
      columns = -inverse.qq.middleCols(block.first_neuron, block.neurons);
      const Index first = std::max(block.first_used - n0, Index{0}), used = block.past_used - n0 - first;
      add_product_transposed(
          columns, inverse.qq.middleCols(first, used),
          inequality.rows_of_a().block(block.first_neuron, n0 + first, block.neurons, used));
    }
    inverse.pq = inverse.qp.transpose();
    inverse.pp.resize(m, m);
    for (const NodeInequality::LayerBlock& block : inequality.blocks()) {
      const Index past = block.first_neuron + block.neurons;  // columns needed for the lower triangle
      auto rows = inverse.pp.block(block.first_neuron, 0, block.neurons, past);
      rows = -inverse.qp.block(block.first_neuron, 0, block.neurons, past);
      const Index first = std::max(block.first_used - n0, Index{0}), used = block.past_used - n0 - first;
      add_product(rows, inequality.rows_of_a().block(block.first_neuron, n0 + first, block.neurons, used),
                  inverse.qp.block(first, 0, used, past));
    }
    weights = (at.rho - at.g.array()).inverse().matrix();
    MatrixXd u(n0 + m, n0);
    u.topRows(n0) = at.vectors * weights.cwiseSqrt().asDiagonal();
    u_q = -(at.half * u.topRows(n0));
    solve_lower_transposed(at.factor, u_q);
    u.bottomRows(m) = u_q;
    u_p = MatrixXd::Zero(m, n0);
    add_product(u_p, inequality.rows_of_a(), u);
    if (!inequality.pairs().empty()) add_pairs(inequality.pairs());
  }

 private:
  void add_pairs(const std::vector<NodeInequality::Factors>& pairs) {
    const Index m = u_p.rows();
    std::vector<Index> p, q;  // columns of [A E]
    for (Index i = 0; i < m; ++i) p.push_back(i), q.push_back(m + i);
    for (const NodeInequality::Factors& pair : pairs) p.push_back(pair.first), q.push_back(pair.second);
    MatrixXd all(2 * m, 2 * m), u(2 * m, u_p.cols());
    all.topLeftCorner(m, m) = inverse.pp.selfadjointView<Eigen::Lower>();
    all.topRightCorner(m, m) = inverse.pq;
    all.bottomLeftCorner(m, m) = inverse.qp;
    all.bottomRightCorner(m, m) = inverse.qq;
    u << u_p, u_q;
    inverse = {all(p, p), all(q, p), all(p, q), all(q, q)};
    u_p = u(p, Eigen::all);
    u_q = u(q, Eigen::all);
  }
};

/// Gradient and Hessian of the barrier with respect to t, with rho eliminated.
struct Model {
  VectorXd gradient;
  MatrixXd hessian;  ///< in the lower triangle

  Model(const NodeInequality& inequality, const Point& at) {
    Kernel kernel(inequality, at);
    Products& products = kernel.inverse;
    gradient = 2 * (kernel.u_p.cwiseProduct(kernel.u_q).rowwise().sum() + kInterior * products.pq.diagonal());
    // tr(X A_i Y A_j) = X_pp o Y_qq + X_qq o Y_pp + X_pq o Y_pq' + X_pq' o Y_pq. For log det R, X = P and
    // Y = 2 S_zz^-1 + P. This equals the term with X = Y = S_zz^-1 + P minus the term with X = Y = S_zz^-1. The Hessian
    // of log det S_zz is kInterior times the latter term.
    hessian = MatrixXd::Zero(gradient.size(), gradient.size());
    products.add_to(hessian, -2 * (1 - kInterior));
    products.add(kernel.u_p, kernel.u_q);
    products.add_to(hessian, 2);
    const VectorXd edge =
        -2 * (kernel.u_q * kernel.weights.asDiagonal()).cwiseProduct(kernel.u_p).rowwise().sum();
    hessian.selfadjointView<Eigen::Lower>().rankUpdate(edge, -1 / kernel.weights.squaredNorm());
  }

  /// Returns -H^-1 gradient, or an empty vector if H is not positive definite. Sets `decrease` to twice the decrease of
  /// the quadratic model.
  VectorXd step(double& decrease) {
    const VectorXd scale = hessian.diagonal().cwiseSqrt().cwiseInverse();
    if (!scale.allFinite()) return {};
    hessian = scale.asDiagonal() * hessian * scale.asDiagonal();
    hessian.diagonal().array() += 1e-12;
    if (!cholesky_in_place(hessian)) return {};
    VectorXd result = scale.cwiseProduct(-gradient);
    solve_cholesky(hessian, result);
    result = scale.cwiseProduct(result);
    decrease = -gradient.dot(result);
    return result;
  }
};

/// Returns mu for a relative gap at multipliers with the largest eigenvalue g.
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
    const Index at_pair = inequality.neurons() + static_cast<Index>(c);
    const auto u_p = kernel.u_p.row(at_pair), u_q = kernel.u_q.row(at_pair);
    const double pp = u_p.squaredNorm(), pq = u_p.dot(u_q), qq = u_q.squaredNorm();
    const double i_pp = kernel.inverse.pp(at_pair, at_pair), i_pq = kernel.inverse.pq(at_pair, at_pair),
                 i_qq = kernel.inverse.qq(at_pair, at_pair);
    const double gradient = 2 * (pq + kInterior * i_pq);
    const double curvature = 2 * (pp * i_qq + qq * i_pp + pp * qq + 2 * pq * i_pq + pq * pq) +
                             2 * kInterior * (i_pp * i_qq + i_pq * i_pq);
    if (curvature > 0) result[c] = gradient * gradient / curvature;
  }
  return result;
}

}  // namespace swarmcert::lipschitz
