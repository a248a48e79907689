/// @file Backward substitution of linear forms through ReLUs. Not for users.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace swarmcert::lipschitz {

/// Data to substitute a form lambda h, h = relu(y), over a box: for each neuron the lines
/// below y <= relu(y) <= slope y + offset, and the constants of y = W h' + b.
struct ReluLines {
  std::vector<Eigen::Index>
      neurons;  ///< neurons that are not off, in order; the vectors have one entry for each
  Eigen::VectorXd slope, offset, below;
  Eigen::VectorXd line_error;         ///< round-off error per unit of lambda if the upper line is used
  Eigen::VectorXd bias, layer_error;  ///< b, and the error per unit of |lambda| (round-off, radius of b)
};

/// Layers restricted to the neurons that are not off.
struct ActiveLayers {
  std::vector<ReluLines> lines;
  std::vector<Eigen::MatrixXd>
      weights;  ///< [lines[j].neurons x lines[j - 1].neurons], for layer 0 [.. x inputs]
};

/// Replaces each form, a row of `lambda` [forms x lines.neurons], by an upper bound in y, and adds the remaining
/// constant and error terms:
///   v > 0: constants += v offset, error += v line_error, v' = slope v;   v <= 0: v' = below v;
///   constants += v' bias, error += |v'| layer_error.
/// @param below if not null, replaces lines.below: [forms x neurons] for all neurons, of which lines.neurons are used.
void pull_back(const ReluLines& lines, const Eigen::MatrixXd* below, Eigen::MatrixXd& lambda,
               Eigen::VectorXd& constants, Eigen::VectorXd& error);

}  // namespace swarmcert::lipschitz
