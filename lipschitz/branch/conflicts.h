/// @file Pairs of activation states that cannot occur together in a box, as additional constraints of the program.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "lipschitz/base/box.h"
#include "lipschitz/values/reach.h"

namespace swarmcert::lipschitz {

/// A pair of states that cannot occur together: s_1 y_1 > 0 and s_2 y_2 > 0 hold nowhere in the box at once, with s = 1
/// for on and s = -1 for off, because lambda s_1 y_1 + (1 - lambda) s_2 y_2 < 0. Neurons are numbered over all outputs
/// of hidden layers.
struct NeuronPair {
  Eigen::Index first = 0, second = 0;  ///< first < second
  bool first_on = true, second_on = true;
  double lambda = 0;
};

/// Linear upper bounds on y and -y of every neuron over a box.
class NeuronForms {
 public:
  /// @param forms as returned by Reach.
  NeuronForms(const std::vector<LinearForms>& forms, const Box& box);

  /// Returns whether the forms prove that the pair is excluded, with a margin for the round-off of a different
  /// implementation. Neurons for which Reach returned no forms are in no pair.
  bool excludes(const NeuronPair& pair) const;

  /// Returns all excluded pairs among `neurons`, which are ascending, each with the lambda of largest margin.
  std::vector<NeuronPair> pairs(const std::vector<Eigen::Index>& neurons) const;

 private:
  double largest(const NeuronPair& pair) const;

  Eigen::MatrixXd slopes_[2];   ///< [inputs x neurons] slopes of y and of -y, times half the box widths
  Eigen::VectorXd centres_[2];  ///< values at the centre of the box
};

}  // namespace swarmcert::lipschitz
