#include "lipschitz/sdp_bound.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

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

/// The neurons that both depend on the input and reach the output, per hidden layer.
std::vector<std::vector<Index>> live_neurons(const ReluChain& chain) {
  std::vector<std::vector<Index>> live(chain.size() - 1);
  for (std::size_t k = 0; k < live.size(); ++k) {
    for (Index i = 0; i < chain[k].rows(); ++i) live[k].push_back(i);
  }
  for (bool changed = true; changed;) {
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

/// The solver's multipliers at the live neurons. A neuron that does not reach the output gets 0, which empties its
/// row of the inequality. A neuron that does, but has no input, gets a multiplier so large, larger in earlier
/// layers, that its coupling to the next layer does not matter.
std::vector<double> expanded(const ReluChain& chain, const std::vector<std::vector<Index>>& live,
                             const Eigen::VectorXd& t) {
  std::vector<std::vector<double>> layers(live.size());
  double huge = t.size() > 0 ? t.maxCoeff() : 1.0;
  for (std::size_t k = live.size(); k-- > 0;) {
    huge = std::ldexp(huge, 40);
    for (Index i = 0; i < chain[k].rows(); ++i) {
      bool reaches = false;
      for (Index j = 0; j < chain[k + 1].rows(); ++j) {
        reaches = reaches || (chain[k + 1](j, i) != 0 &&
                              (k + 1 == live.size() || layers[k + 1][static_cast<std::size_t>(j)] > 0));
      }
      layers[k].push_back(reaches ? huge : 0.0);
    }
  }
  std::vector<double> result;
  Index next = 0;
  for (std::size_t k = 0; k < live.size(); ++k) {
    for (const Index i : live[k]) layers[k][static_cast<std::size_t>(i)] = t(next++);
    result.insert(result.end(), layers[k].begin(), layers[k].end());
  }
  return result;
}

/// Without hidden layers the constant is the norm of the one matrix.
SdpBound linear_bound(const std::vector<check::Matrix>& stages, const MatrixXd& m) {
  SdpBound result;
  const MatrixXd gram = m.rows() <= m.cols() ? MatrixXd(m * m.transpose()) : MatrixXd(m.transpose() * m);
  const double rho = std::max(
      0.0, Eigen::SelfAdjointEigenSolver<MatrixXd>(gram, Eigen::EigenvaluesOnly).eigenvalues().maxCoeff());
  result.optimum = Estimate(std::sqrt(rho));
  result.stop = LipSdpStop::kGapReached;
  for (double slack = 1e-14; slack < 1 && !result.proof; slack *= 4) {
    result.proof = prove(stages, std::max(rho * (1 + slack), std::numeric_limits<double>::min()), {});
  }
  return result;
}

}  // namespace

SdpBound sdp_bound(const std::vector<check::Matrix>& stages, const std::atomic<bool>* cancelled) {
  const ReluChain chain = rounded(stages);
  if (chain.size() == 1) return linear_bound(stages, chain.front());

  SdpBound result;
  const std::vector<std::vector<Index>> live = live_neurons(chain);
  if (live.front().empty()) {  // constant: the smallest rho will do
    result.stop = LipSdpStop::kGapReached;
    result.proof =
        prove(stages, std::numeric_limits<double>::min(), expanded(chain, live, Eigen::VectorXd()));
    return result;
  }
  LipSdpOptions options;
  options.cancelled = cancelled;
  const LipSdpResult solved = solve_lipsdp(restricted(chain, live), options);
  result.stop = solved.stop;
  result.iterations = solved.iterations;
  result.optimum = solved.optimum_upper;
  for (auto point = solved.points.rbegin(); point != solved.points.rend() && !result.proof; ++point) {
    const std::vector<double> t = expanded(chain, live, point->t);
    for (const double slack : {0.0, 1e-9, 1e-8}) {
      result.proof = prove(stages, point->rho * (1 + slack), t);
      if (result.proof) break;
    }
  }
  return result;
}

}  // namespace swarmcert::lipschitz
