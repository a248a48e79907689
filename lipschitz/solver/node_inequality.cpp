#include "lipschitz/solver/node_inequality.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "lipschitz/solver/dense_kernels.h"

namespace swarmcert::lipschitz {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

NodeInequality::NodeInequality(const std::vector<SlopeLayer>& layers, const MatrixXd& gram)
    : inputs_(layers.front().weights.cols()) {
  Index neuron = 0, tie = -1;
  bool is_tied = false;
  for (const SlopeLayer& layer : layers) {
    is_tied = is_tied || layer.group > 1;
    Index group = -1;
    for (Index i = 0; i < layer.width.size(); ++i, ++neuron) {
      if (!(layer.width(i) > 0)) continue;
      if (i / layer.group != std::exchange(group, i / layer.group)) ++tie;
      undecided_.push_back(neuron);
      ties_.push_back(tie);
    }
  }
  if (!is_tied) ties_.clear();
  const auto free = static_cast<Index>(undecided_.size());
  const Index n = inputs_ + free;
  a_ = MatrixXd::Zero(free, n);

  // y and z as linear forms in the variables, layer by layer; y is zero outside of columns [first_used, past_used).
  Index variable = 0, first_used = 0;
  MatrixXd z = MatrixXd::Identity(inputs_, n);
  for (const SlopeLayer& layer : layers) {
    const Index rows = layer.weights.rows(), before = variable, past_used = inputs_ + before;
    const Index used = past_used - first_used;
    MatrixXd y = MatrixXd::Zero(rows, n);
    add_product(y.middleCols(first_used, used), layer.weights, z.middleCols(first_used, used));
    z = layer.low.asDiagonal() * y;
    for (Index i = 0; i < rows; ++i) {
      if (!(layer.width(i) > 0)) continue;
      const double root = std::sqrt(layer.width(i));
      z(i, inputs_ + variable) = root;
      a_.row(variable).segment(first_used, used) = root * y.row(i).segment(first_used, used);
      a_(variable, inputs_ + variable) = -1;
      ++variable;
    }
    if (variable > before) blocks_.push_back({before, variable - before, first_used, past_used});
    if (layer.low.isZero(0)) first_used = past_used;
  }
  MatrixXd gram_z = MatrixXd::Zero(z.rows(), n);
  add_product(gram_z, gram, z);
  last_gram_ = MatrixXd::Zero(n, n);
  add_transposed_product(last_gram_, z, gram_z);
}

MatrixXd NodeInequality::linear(const VectorXd& y) const {
  MatrixXd s = MatrixXd::Zero(size(), size());
  s.diagonal().head(inputs_).setConstant(y(0));
  const MatrixXd t_a = y.tail(neurons()).asDiagonal() * a_;
  s.rightCols(neurons()) -= t_a.transpose();
  s.bottomRows(neurons()) -= t_a;
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
  for (const LayerBlock& block : blocks_) {
    const Index used = block.past_used - block.first_used;
    s.block(inputs_ + block.first_neuron, block.first_used, block.neurons, used) -=
        t.segment(block.first_neuron, block.neurons).asDiagonal() *
        a_.block(block.first_neuron, block.first_used, block.neurons, used);
  }
  s.diagonal().tail(m) += 2 * t.head(m);
  Index used = 0;
  MatrixXd left(size(), static_cast<Index>(pairs_.size())), right(size(), static_cast<Index>(pairs_.size()));
  for (std::size_t c = 0; c < pairs_.size(); ++c) {
    const double weight = t(m + static_cast<Index>(c));
    if (weight == 0) continue;
    auto [p, q] = pairs_[c];
    if (p > q) std::swap(p, q);  // unit vectors come last
    const Index unit = inputs_ + q - m;
    if (p >= m) {
      s(inputs_ + p - m, unit) -= weight;
      s(unit, inputs_ + p - m) -= weight;
    } else if (q >= m) {
      s.row(unit) -= weight * a_.row(p);
      s.col(unit) -= weight * a_.row(p).transpose();
    } else {
      left.col(used) = -weight * a_.row(p).transpose();
      right.col(used++) = a_.row(q).transpose();
    }
  }
  if (used == 0) return s;
  MatrixXd half = MatrixXd::Zero(size(), size());
  add_product_transposed(half, left.leftCols(used), right.leftCols(used));
  return s + half + half.transpose();
}

MatrixXd NodeInequality::times_a(const MatrixXd& x) const {
  MatrixXd result = MatrixXd::Zero(x.rows(), a_.rows());
  add_product_transposed(result, x, a_);
  return result;
}

MatrixXd NodeInequality::a_transposed_times(const MatrixXd& x) const {
  MatrixXd result = MatrixXd::Zero(a_.rows(), x.cols());
  add_product(result, a_, x);
  return result;
}

MatrixXd NodeInequality::times_patterned(const MatrixXd& x, const MatrixXd& d) const {
  MatrixXd result = MatrixXd::Zero(x.rows(), d.cols());
  add_product(result, x, d);
  return result;
}

MatrixXd NodeInequality::least_form(const VectorXd& t) const {
  MatrixXd s = slack_without_rho(t);
  MatrixXd inner = -s.topLeftCorner(inputs_, inputs_);  // Q >= this + S_xz S_zz^-1 S_zx
  if (neurons() > 0) {
    Eigen::Ref<MatrixXd> factor = s.bottomRightCorner(neurons(), neurons());
    if (!cholesky_in_place(factor)) return {};
    Eigen::Ref<MatrixXd> half = s.bottomLeftCorner(neurons(), inputs_);
    solve_lower(factor, half);
    add_transposed_product(inner, half, half);
  }
  return inner;
}

double NodeInequality::least_rho(const VectorXd& t) const {
  const MatrixXd form = least_form(t);
  if (form.size() == 0) return std::numeric_limits<double>::infinity();
  return Eigen::SelfAdjointEigenSolver<MatrixXd>(form, Eigen::EigenvaluesOnly).eigenvalues().maxCoeff();
}

}  // namespace swarmcert::lipschitz
