#include "lipschitz/branch/conflicts.h"

#include <cmath>

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Relative margin by which the sum of a pair must be below zero, so that the checker comes to the same result.
constexpr double kMargin = 1e-7;

}  // namespace

NeuronForms::NeuronForms(const std::vector<LinearForms>& forms, const Box& box) {
  const auto inputs = static_cast<Index>(box.lower.size());
  const Eigen::Map<const VectorXd> lower(box.lower.data(), inputs), upper(box.upper.data(), inputs);
  const VectorXd half = (upper - lower) / 2, centre = (lower + upper) / 2;
  Index neurons = 0, first = 0;
  for (const LinearForms& layer : forms) neurons += layer.rows.rows() / 2;
  for (int side = 0; side < 2; ++side) {
    slopes_[side].resize(inputs, neurons);
    centres_[side].resize(neurons);
  }
  for (const LinearForms& layer : forms) {
    const Index rows = layer.rows.rows() / 2;
    for (int side = 0; side < 2; ++side) {
      const auto own = layer.rows.middleRows(side * rows, rows);
      slopes_[side].middleCols(first, rows) = half.asDiagonal() * own.transpose();
      centres_[side].segment(first, rows) = own * centre + layer.constants.segment(side * rows, rows);
    }
    first += rows;
  }
}

double NeuronForms::largest(const NeuronPair& pair) const {
  const int a = pair.first_on ? 0 : 1, b = pair.second_on ? 0 : 1;
  const double one = pair.lambda, other = 1 - pair.lambda;
  return one * centres_[a](pair.first) + other * centres_[b](pair.second) +
         (one * slopes_[a].col(pair.first) + other * slopes_[b].col(pair.second)).cwiseAbs().sum();
}

bool NeuronForms::excludes(const NeuronPair& pair) const {
  const int a = pair.first_on ? 0 : 1, b = pair.second_on ? 0 : 1;
  const double size =
      pair.lambda * (std::abs(centres_[a](pair.first)) + slopes_[a].col(pair.first).cwiseAbs().sum()) +
      (1 - pair.lambda) * (std::abs(centres_[b](pair.second)) + slopes_[b].col(pair.second).cwiseAbs().sum());
  return largest(pair) < -kMargin * size;  // false for NaN
}

std::vector<NeuronPair> NeuronForms::pairs(const std::vector<Index>& neurons) const {
  std::vector<NeuronPair> result;
  for (std::size_t i = 0; i < neurons.size(); ++i) {
    for (std::size_t j = i + 1; j < neurons.size(); ++j) {
      for (const bool first_on : {true, false}) {
        for (const bool second_on : {true, false}) {
          NeuronPair pair{neurons[i], neurons[j], first_on, second_on, 0};
          const double u = centres_[first_on ? 0 : 1](pair.first),
                       v = centres_[second_on ? 0 : 1](pair.second);
          if (!(u < 0 || v < 0)) continue;
          const auto p = slopes_[first_on ? 0 : 1].col(pair.first);
          const auto q = slopes_[second_on ? 0 : 1].col(pair.second);
          if (!(p.dot(q) < 0)) continue;  // the forms do not cancel
          // The largest value is convex and piecewise linear in lambda, so its minimum is at a kink.
          double least = 0, best = -1;
          for (Index k = 0; k < p.size(); ++k) {
            if (!(p(k) * q(k) < 0)) continue;
            pair.lambda = q(k) / (q(k) - p(k));
            const double value = largest(pair);
            if (value < least) least = value, best = pair.lambda;
          }
          pair.lambda = best;
          if (best >= 0 && excludes(pair)) result.push_back(pair);
        }
      }
    }
  }
  return result;
}

}  // namespace swarmcert::lipschitz
