#include "lipschitz/branch/node_inequality.h"

#include <Eigen/Eigenvalues>
#include <limits>

#include "lipschitz/dense_kernels.h"

namespace swarmcert::lipschitz {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

NodeInequality::NodeInequality(const LocalChain& chain, const std::vector<NeuronState>& states)
    : inputs_(static_cast<Index>(chain.block.size())) {
  for (std::size_t i = 0; i < states.size(); ++i)
    if (states[i] == NeuronState::kUndecided) undecided_.push_back(static_cast<Index>(i));
  const auto free = static_cast<Index>(undecided_.size());
  const Index n = inputs_ + free;
  a_ = MatrixXd::Zero(n, free);

  // y and z as linear forms in the variables, layer by layer.
  MatrixXd y = MatrixXd::Zero(chain.hidden.front().weights.rows(), n);
  y.leftCols(inputs_) = chain.hidden.front().weights(Eigen::all, chain.block);
  for (Index k = 0; k < inputs_; ++k) y.col(k) *= chain.weight[static_cast<std::size_t>(k)];
  Index neuron = 0, variable = 0;
  MatrixXd z;
  for (std::size_t k = 0; k < chain.hidden.size(); ++k) {
    const Index rows = chain.hidden[k].weights.rows();
    z = MatrixXd::Zero(rows, n);
    for (Index i = 0; i < rows; ++i, ++neuron) {
      const NeuronState state = states[static_cast<std::size_t>(neuron)];
      if (state == NeuronState::kOn) z.row(i) = y.row(i);
      if (state != NeuronState::kUndecided) continue;
      z(i, inputs_ + variable) = 1;
      a_.col(variable) = y.row(i).transpose();
      a_(inputs_ + variable, variable) -= 1;
      ++variable;
    }
    if (k + 1 == chain.hidden.size()) break;
    y = MatrixXd::Zero(chain.hidden[k + 1].weights.rows(), n);
    // Only inputs and the neurons so far occur in z.
    add_product(y.leftCols(inputs_ + variable), chain.hidden[k + 1].weights, z.leftCols(inputs_ + variable));
  }
  MatrixXd gram_z = MatrixXd::Zero(z.rows(), n);
  add_product(gram_z, chain.gram, z);
  last_gram_ = MatrixXd::Zero(n, n);
  add_product(last_gram_, MatrixXd(z.transpose()), gram_z);
}

MatrixXd NodeInequality::linear(const VectorXd& y) const {
  MatrixXd s = MatrixXd::Zero(size(), size());
  s.diagonal().head(inputs_).setConstant(y(0));
  const MatrixXd a_t = a_ * y.tail(neurons()).asDiagonal();
  s.rightCols(neurons()) -= a_t;
  s.bottomRows(neurons()) -= a_t.transpose();
  return s;
}

MatrixXd NodeInequality::slack(const VectorXd& y) const { return linear(y) - last_gram_; }

MatrixXd NodeInequality::times_a(const MatrixXd& x) const {
  MatrixXd result = MatrixXd::Zero(x.rows(), a_.cols());
  add_product(result, x, a_);
  return result;
}

MatrixXd NodeInequality::a_transposed_times(const MatrixXd& x) const {
  MatrixXd result = MatrixXd::Zero(a_.cols(), x.cols());
  add_product(result, MatrixXd(a_.transpose()), x);
  return result;
}

MatrixXd NodeInequality::times_patterned(const MatrixXd& x, const MatrixXd& d) const {
  MatrixXd result = MatrixXd::Zero(x.rows(), d.cols());
  add_product(result, x, d);
  return result;
}

double NodeInequality::least_rho(const VectorXd& t) const {
  VectorXd y(1 + neurons());
  y << 0, t;
  const MatrixXd s = slack(y);
  MatrixXd inner = -s.topLeftCorner(inputs_, inputs_);  // rho I >= this + S_xz S_zz^-1 S_zx
  if (neurons() > 0) {
    const MatrixXd factor = cholesky(s.bottomRightCorner(neurons(), neurons()));
    if (factor.size() == 0) return std::numeric_limits<double>::infinity();
    const MatrixXd half = factor.triangularView<Eigen::Lower>().solve(s.bottomLeftCorner(neurons(), inputs_));
    inner += half.transpose() * half;
  }
  return Eigen::SelfAdjointEigenSolver<MatrixXd>(inner, Eigen::EigenvaluesOnly).eigenvalues().maxCoeff();
}

}  // namespace swarmcert::lipschitz
