#include "lipschitz/upper/live_chain.h"

#include <algorithm>
#include <cmath>

#include "lipschitz/upper/lmi_proof.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// Returns per hidden layer the neurons that depend on the input and reach the output.
std::vector<std::vector<Index>> live_neurons(const ReluChain& chain, bool keeps_all) {
  std::vector<std::vector<Index>> live(chain.size() - 1);
  for (std::size_t k = 0; k < live.size(); ++k) {
    for (Index i = 0; i < chain[k].rows(); ++i) live[k].push_back(i);
  }
  for (bool changed = !keeps_all; changed;) {
    changed = false;
    for (std::size_t k = 0; k < live.size(); ++k) {
      const auto is_dead = [&](Index i) {
        const MatrixXd& in = chain[k];
        const MatrixXd& out = chain[k + 1];
        bool has_input = false;
        bool has_effect = false;
        if (k == 0) {
          has_input = !in.row(i).isZero(0);
        } else {
          for (const Index j : live[k - 1]) has_input = has_input || in(i, j) != 0;
        }
        if (k + 1 == live.size()) {
          has_effect = !out.col(i).isZero(0);
        } else {
          for (const Index j : live[k + 1]) has_effect = has_effect || out(j, i) != 0;
        }
        return !has_input || !has_effect;
      };
      const auto end = std::remove_if(live[k].begin(), live[k].end(), is_dead);
      changed = changed || end != live[k].end();
      live[k].erase(end, live[k].end());
    }
  }
  return live;
}

ReluChain restricted(const ReluChain& chain, const std::vector<std::vector<Index>>& live) {
  ReluChain result;
  for (std::size_t k = 0; k < chain.size(); ++k) {
    std::vector<Index> rows(static_cast<std::size_t>(chain[k].rows()));
    std::vector<Index> cols(static_cast<std::size_t>(chain[k].cols()));
    for (std::size_t i = 0; i < rows.size(); ++i) rows[i] = static_cast<Index>(i);
    for (std::size_t j = 0; j < cols.size(); ++j) cols[j] = static_cast<Index>(j);
    if (k < live.size()) rows = live[k];
    if (k > 0) cols = live[k - 1];
    result.push_back(chain[k](rows, cols));
  }
  return result;
}

}  // namespace

ReluChain rounded(const std::vector<check::Matrix>& stages) {
  ReluChain chain;
  for (const check::Matrix& stage : stages) {
    MatrixXd m(stage.rows, stage.cols);
    for (int i = 0; i < stage.rows; ++i) {
      for (int j = 0; j < stage.cols; ++j) m(i, j) = to_double(stage(i, j));
    }
    chain.push_back(std::move(m));
  }
  return chain;
}

LiveChain::LiveChain(const std::vector<check::Matrix>& stages, bool keeps_all)
    : chain_(rounded(stages)),
      neurons_(live_neurons(chain_, keeps_all)),
      live_(restricted(chain_, neurons_)) {}

std::vector<double> LiveChain::multipliers(const Eigen::VectorXd& t) const {
  std::vector<std::vector<double>> layers(neurons_.size());
  double huge = t.size() > 0 ? t.maxCoeff() : 1.0;
  for (std::size_t k = neurons_.size(); k-- > 0;) {
    huge = std::ldexp(huge, 40);
    for (Index i = 0; i < chain_[k].rows(); ++i) {
      bool reaches = false;
      for (Index j = 0; j < chain_[k + 1].rows(); ++j) {
        reaches = reaches || (chain_[k + 1](j, i) != 0 &&
                              (k + 1 == neurons_.size() || layers[k + 1][static_cast<std::size_t>(j)] > 0));
      }
      layers[k].push_back(reaches ? huge : 0.0);
    }
  }
  std::vector<double> result;
  Index next = 0;
  for (std::size_t k = 0; k < neurons_.size(); ++k) {
    for (const Index i : neurons_[k]) layers[k][static_cast<std::size_t>(i)] = t(next++);
    result.insert(result.end(), layers[k].begin(), layers[k].end());
  }
  return result;
}

}  // namespace swarmcert::lipschitz
