/// @file A chain in double without the neurons that no input reaches or that reach no output. Not for users.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "lipschitz/checker/dyadic.h"
#include "lipschitz/solver/lipsdp_solver.h"

namespace swarmcert::lipschitz {

/// Returns M_1 .. M_K rounded to the nearest doubles.
ReluChain rounded(const std::vector<check::Matrix>& stages);

/// The live part of a chain, for which multipliers are searched, and the conversion to multipliers of the whole chain.
class LiveChain {
 public:
  /// @param keeps_all all neurons count as live.
  explicit LiveChain(const std::vector<check::Matrix>& stages, bool keeps_all = false);

  /// Returns the chain of live neurons; the whole chain if there are no hidden layers.
  const ReluChain& live() const { return live_; }
  /// Returns whether no neuron is live, so that the function is constant.
  bool is_constant() const { return !neurons_.empty() && neurons_.front().empty(); }

  /// The live neurons of each hidden layer.
  const std::vector<std::vector<Eigen::Index>>& neurons() const { return neurons_; }

  /// Returns multipliers of the whole chain, one per hidden neuron. A neuron that does not reach the output gets 0,
  /// which makes its row of the inequality zero. A neuron that reaches the output but has no input gets a multiplier so
  /// large (larger in earlier layers) that its coupling to the next layer does not matter.
  /// @param t one multiplier per live neuron, first layer first.
  std::vector<double> multipliers(const Eigen::VectorXd& t) const;

 private:
  ReluChain chain_;
  std::vector<std::vector<Eigen::Index>> neurons_;  ///< live neurons per hidden layer
  ReluChain live_;
};

}  // namespace swarmcert::lipschitz
