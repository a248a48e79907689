/// @file Pairs of activation states that a box excludes, as additional constraints of the program.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "lipschitz/base/box.h"
#include "lipschitz/values/reach.h"

namespace swarmcert::lipschitz {

/// Nowhere in the box are s_1 y_1 > 0 and s_2 y_2 > 0 at once, s = 1 for `on` and -1 for off, since
/// lambda s_1 y_1 + (1 - lambda) s_2 y_2 < 0. Neurons are counted over all outputs of hidden layers.
struct NeuronPair {
  Eigen::Index first = 0, second = 0;  ///< first < second
  bool first_on = true, second_on = true;
  double lambda = 0;
};

/// Linear forms above every neuron's y and -y over a box.
class NeuronForms {
 public:
  /// @param forms as Reach gives them.
  NeuronForms(const std::vector<LinearForms>& forms, const Box& box);

  /// Whether the forms show it, with a margin for another's rounding. Neurons whose forms Reach left out are in no
  /// pair.
  bool excludes(const NeuronPair& pair) const;

  /// All pairs among `neurons`, ascending, with the lambda that shows them best.
  std::vector<NeuronPair> pairs(const std::vector<Eigen::Index>& neurons) const;

 private:
  double largest(const NeuronPair& pair) const;

  Eigen::MatrixXd slopes_[2];   ///< [inputs x neurons] of y and of -y, times half the box's widths
  Eigen::VectorXd centres_[2];  ///< values at the box's centre
};

}  // namespace swarmcert::lipschitz
