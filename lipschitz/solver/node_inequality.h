/// @file LipSDP-Neuron where each neuron has a range of slopes of its own, with those that have one slope eliminated.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "lipschitz/solver/interior_point.h"

namespace swarmcert::lipschitz {

/// A pair of states that cannot occur together: s_1 y_1 > 0 and s_2 y_2 > 0 hold nowhere in the box at once, with s = 1
/// for on and s = -1 for off, because lambda s_1 y_1 + (1 - lambda) s_2 y_2 < 0. Neurons are numbered over all outputs
/// of hidden layers.
struct NeuronPair {
  Eigen::Index first = 0, second = 0;  ///< first < second
  bool first_on = true, second_on = true;
  double lambda = 0;
};

/// One hidden layer; the slope of neuron i lies in [low_i, low_i + width_i].
struct SlopeLayer {
  Eigen::MatrixXd weights;
  Eigen::VectorXd low, width;
  /// Neurons of one group, which follow one another, share a multiplier: |dz| <= |dy| holds for them together. 1: none.
  int group = 1;
};

/// The matrix S(rho, t) over the moving inputs and a variable w = (dz - low dy) / sqrt(width) for each undecided neuron
/// with w (sqrt(width) dy - w) >= 0. Neurons of width 0 have dz = low dy, which is substituted, so that S is dense but
/// small. If S is positive semidefinite, then |df|^2 <= rho |dx|^2 for all pairs of points of the box, because the
/// segment between them stays inside.
class NodeInequality final : public RankTwoInequality {
 public:
  /// @param gram G of the function behind the hidden layers.
  NodeInequality(const std::vector<SlopeLayer>& layers, const Eigen::MatrixXd& gram);

  Eigen::Index size() const override { return a_.cols(); }
  Eigen::Index inputs() const override { return inputs_; }
  Eigen::MatrixXd linear(const Eigen::VectorXd& y) const override;
  Eigen::MatrixXd slack(const Eigen::VectorXd& y) const override;
  Eigen::MatrixXd times_a(const Eigen::MatrixXd& x) const override;
  Eigen::MatrixXd a_transposed_times(const Eigen::MatrixXd& x) const override;
  Eigen::MatrixXd times_patterned(const Eigen::MatrixXd& x, const Eigen::MatrixXd& d) const override;
  std::vector<Eigen::Index> ties() const override { return ties_; }

  /// Adds the constraint of a pair of undecided neurons: 2 u_1 u_2 = 0 with u = dz (on) or dy - dz (off). Its
  /// multiplier may have either sign.
  void add(const NeuronPair& pair);
  /// Columns of [A E] that represent u_1 and u_2 of a pair; E are the unit vectors of the neurons.
  struct Factors {
    Eigen::Index first, second;
  };
  const std::vector<Factors>& pairs() const { return pairs_; }

  /// Returns the lower triangle of S(0, t); t contains the multipliers of the neurons, then those of the pairs.
  Eigen::MatrixXd slack_without_rho(const Eigen::VectorXd& t) const;
  /// [neurons x size], row i is a_i'.
  const Eigen::MatrixXd& rows_of_a() const { return a_; }
  /// The neurons of one layer. Except for -1 at its own variable, each a_i is zero outside the variables
  /// [first_used, past_used).
  struct LayerBlock {
    Eigen::Index first_neuron, neurons, first_used, past_used;
  };
  const std::vector<LayerBlock>& blocks() const { return blocks_; }

  /// Indices of the undecided neurons among all, ascending: t has one entry for each.
  const std::vector<Eigen::Index>& undecided() const { return undecided_; }

  /// Returns the least rho with S(rho, t) >= 0, up to round-off, or infinity if there is none. `t` as in
  /// slack_without_rho().
  double least_rho(const Eigen::VectorXd& t) const;
  /// Returns the least Q with |df|^2 <= dx' Q dx for these multipliers, or an empty matrix if there is none.
  Eigen::MatrixXd least_form(const Eigen::VectorXd& t) const;

 private:
  Eigen::Index inputs_;
  std::vector<Eigen::Index> undecided_;
  Eigen::MatrixXd a_;  ///< [neurons x size] rows a_i'
  std::vector<LayerBlock> blocks_;
  std::vector<Factors> pairs_;
  std::vector<Eigen::Index> ties_;
  Eigen::MatrixXd last_gram_;  ///< Gram matrix of df in the variables
};

}  // namespace swarmcert::lipschitz
