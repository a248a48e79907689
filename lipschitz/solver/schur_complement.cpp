#include "lipschitz/solver/schur_complement.h"

#include "lipschitz/solver/dense_kernels.h"

namespace swarmcert::lipschitz {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd functionals(const RankTwoInequality& it, const MatrixXd& x, const MatrixXd& x_a) {
  VectorXd v(1 + it.neurons());
  v(0) = x.diagonal().head(it.inputs()).sum();
  v.tail(it.neurons()) = -2.0 * x_a.bottomRows(it.neurons()).diagonal();
  return v;
}

MatrixXd schur_complement(const RankTwoInequality& it, const MatrixXd& z, const MatrixXd& z_a,
                          const MatrixXd& y, const MatrixXd& y_a) {
  const Index n0 = it.inputs();
  const Index m = it.neurons();
  const MatrixXd a_z_a = it.a_transposed_times(z_a);
  const MatrixXd a_y_a = it.a_transposed_times(y_a);
  MatrixXd schur(m + 1, m + 1);
  const auto e_z_a = z_a.bottomRows(m).array();
  const MatrixXd cross = e_z_a * y_a.bottomRows(m).transpose().array();
  schur.bottomRightCorner(m, m) = cross + cross.transpose();
  schur.bottomRightCorner(m, m).array() += z.bottomRightCorner(m, m).array() * a_y_a.array();
  schur.bottomRightCorner(m, m).array() += a_z_a.array() * y.bottomRightCorner(m, m).array();
  const VectorXd edge = -((z_a.topRows(n0).array() * y.topRightCorner(n0, m).array()).colwise().sum() +
                          (z.topRightCorner(n0, m).array() * y_a.topRows(n0).array()).colwise().sum())
                             .transpose();
  schur.col(0).tail(m) = edge;
  schur.row(0).tail(m) = edge.transpose();
  schur(0, 0) = (z.topLeftCorner(n0, n0).array() * y.topLeftCorner(n0, n0).array()).sum();
  return schur;
}

SchurSolver::SchurSolver(const MatrixXd& schur) : scale_(schur.diagonal().cwiseSqrt().cwiseInverse()) {
  scaled_ = scale_.asDiagonal() * schur * scale_.asDiagonal();
  for (double regularisation = 1e-15; regularisation < 1e-6; regularisation *= 100) {
    MatrixXd shifted = scaled_;
    shifted.diagonal().array() += regularisation;
    factor_ = cholesky(shifted);
    if (factor_.size() > 0) break;
  }
}

VectorXd SchurSolver::solve(const VectorXd& rhs) const {
  const VectorXd b = scale_.cwiseProduct(rhs);
  VectorXd v = b;
  solve_cholesky(factor_, v);
  for (int i = 0; i < 2; ++i) {  // undoes the regularisation
    VectorXd residual = b;
    add_symmetric_product(residual, -1.0, scaled_, v);
    solve_cholesky(factor_, residual);
    v += residual;
  }
  return scale_.cwiseProduct(v);
}

}  // namespace swarmcert::lipschitz
