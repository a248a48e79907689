/// @file LipSDP-Neuron on a box: the neurons that the box decides are no variables any more.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "lipschitz/branch/conflicts.h"
#include "lipschitz/branch/local_chain.h"
#include "lipschitz/solver/interior_point.h"

namespace swarmcert::lipschitz {

/// What a box leaves of a neuron's slope.
enum class NeuronState : char { kOff, kOn, kUndecided };

/// S(rho, t) over the moving inputs and the undecided neurons. A neuron that is off has dz = 0, one that is on dz = dy:
/// both are substituted, so that S is dense but small. Positive semidefinite, it proves |df|^2 <= rho |dx|^2 for all
/// pairs of points of the box, since the segment between them stays inside.
class NodeInequality final : public RankTwoInequality {
 public:
  /// @param gram G of what follows the hidden layers.
  NodeInequality(const LocalChain& chain, const std::vector<NeuronState>& states,
                 const Eigen::MatrixXd& gram);
  /// With the chain's own.
  NodeInequality(const LocalChain& chain, const std::vector<NeuronState>& states)
      : NodeInequality(chain, states, chain.gram) {}

  Eigen::Index size() const override { return a_.cols(); }
  Eigen::Index inputs() const override { return inputs_; }
  Eigen::MatrixXd linear(const Eigen::VectorXd& y) const override;
  Eigen::MatrixXd slack(const Eigen::VectorXd& y) const override;
  Eigen::MatrixXd times_a(const Eigen::MatrixXd& x) const override;
  Eigen::MatrixXd a_transposed_times(const Eigen::MatrixXd& x) const override;
  Eigen::MatrixXd times_patterned(const Eigen::MatrixXd& x, const Eigen::MatrixXd& d) const override;

  /// Adds a pair of undecided neurons: with u = dz (on) or dy - dz (off), 2 u_1 u_2 = 0 gets a multiplier of either
  /// sign.
  void add(const NeuronPair& pair);
  /// Columns of [A E], E the unit vectors of the neurons, that make up u_1 and u_2 of a pair.
  struct Factors {
    Eigen::Index first, second;
  };
  const std::vector<Factors>& pairs() const { return pairs_; }

  /// The lower triangle of S(0, t) for the multipliers of the neurons, and of the pairs behind them.
  Eigen::MatrixXd slack_without_rho(const Eigen::VectorXd& t) const;
  /// [neurons x size], row i is a_i'.
  const Eigen::MatrixXd& rows_of_a() const { return a_; }
  /// The neurons of one layer: beside -1 at their own variables, their a_i are zero outside of variables
  /// [first_used, past_used).
  struct LayerBlock {
    Eigen::Index first_neuron, neurons, first_used, past_used;
  };
  const std::vector<LayerBlock>& blocks() const { return blocks_; }

  /// Indices of the undecided neurons among all, ascending: t has one entry for each.
  const std::vector<Eigen::Index>& undecided() const { return undecided_; }

  /// The least rho with S(rho, t) >= 0, up to rounding; infinity if there is none. `t` as in slack_without_rho().
  double least_rho(const Eigen::VectorXd& t) const;
  /// The least Q with |df|^2 <= dx' Q dx for these multipliers; empty if there is none.
  Eigen::MatrixXd least_form(const Eigen::VectorXd& t) const;

 private:
  Eigen::Index inputs_;
  std::vector<Eigen::Index> undecided_;
  Eigen::MatrixXd a_;  ///< [neurons x size] rows a_i'
  std::vector<LayerBlock> blocks_;
  std::vector<Factors> pairs_;
  Eigen::MatrixXd last_gram_;  ///< of df in the variables
};

}  // namespace swarmcert::lipschitz
