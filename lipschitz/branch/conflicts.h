/// @file Pairs of activation states that cannot occur together in a box, as additional constraints of the program.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "lipschitz/base/box.h"
#include "lipschitz/solver/node_inequality.h"
#include "lipschitz/values/reach.h"

namespace swarmcert::lipschitz {

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
