#include "lipschitz/branch/node_inequality.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
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

void NodeInequality::add(const NeuronPair& pair) {
  const auto column = [this](Index neuron, bool is_on) {
    const auto at = std::lower_bound(undecided_.begin(), undecided_.end(), neuron) - undecided_.begin();
    return static_cast<Index>(at) + (is_on ? neurons() : 0);
  };
  pairs_.push_back({column(pair.first, pair.first_on), column(pair.second, pair.second_on)});
}

MatrixXd NodeInequality::slack_without_rho(const VectorXd& t) const {
  const Index m = neurons();
  MatrixXd s = -last_gram_;
  for (Index i = 0; i < m; ++i) {  // a_i ends at its own neuron
    const Index rows = inputs_ + i + 1;
    s.col(inputs_ + i).head(rows) -= t(i) * a_.col(i).head(rows);
    s.row(inputs_ + i).head(rows) -= t(i) * a_.col(i).head(rows).transpose();
  }
  Index used = 0;
  MatrixXd left(size(), static_cast<Index>(pairs_.size())), right(size(), static_cast<Index>(pairs_.size()));
  for (std::size_t c = 0; c < pairs_.size(); ++c) {
    const double weight = t(m + static_cast<Index>(c));
    if (weight == 0) continue;
    auto [p, q] = pairs_[c];
    if (p > q) std::swap(p, q);  // a unit vector last
    const Index unit = inputs_ + q - m;
    if (p >= m) {
      s(inputs_ + p - m, unit) -= weight;
      s(unit, inputs_ + p - m) -= weight;
    } else if (q >= m) {
      s.row(unit) -= weight * a_.col(p).transpose();
      s.col(unit) -= weight * a_.col(p);
    } else {
      left.col(used) = -weight * a_.col(p);
      right.col(used++) = a_.col(q);
    }
  }
  if (used == 0) return s;
  MatrixXd half = MatrixXd::Zero(size(), size());
  add_product_transposed(half, left.leftCols(used), right.leftCols(used));
  return s + half + half.transpose();
}

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
  const MatrixXd s = slack_without_rho(t);
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
