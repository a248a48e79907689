/// @file Linear forms of neurons pulled back through ReLUs. Not for users.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace swarmcert::lipschitz {

/// What becomes of a form lambda h, h = relu(y), over y of a box: per neuron the lines below y <= relu(y) <= slope y +
/// offset, then the terms of y = W h' + b.
struct ReluLines {
  std::vector<Eigen::Index>
      neurons;  ///< those that are not off, in order; the vectors have one entry for each
  Eigen::VectorXd slope, offset, below;
  Eigen::VectorXd line_error;         ///< what rounding costs per unit of lambda where the upper line is used
  Eigen::VectorXd bias, layer_error;  ///< b, and what rounding and a radius of b cost per unit of |lambda|
};

/// Layers without the neurons that are off.
struct ActiveLayers {
  std::vector<ReluLines> lines;
  std::vector<Eigen::MatrixXd>
      weights;  ///< [lines[j].neurons x lines[j - 1].neurons], of layer 0 [.. x inputs]
};

/// Replaces each form, a row of `lambda` [forms x lines.neurons], by one above it in y, and adds what it leaves behind:
///   v > 0: constants += v offset, error += v line_error, v' = slope v;   v <= 0: v' = below v;
///   constants += v' bias, error += |v'| layer_error.
/// @param below if not null, in place of lines.below: [forms x neurons], those that `lines` has among others.
void pull_back(const ReluLines& lines, const Eigen::MatrixXd* below, Eigen::MatrixXd& lambda,
               Eigen::VectorXd& constants, Eigen::VectorXd& error);

}  // namespace swarmcert::lipschitz
