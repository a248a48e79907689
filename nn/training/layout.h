/// @file Where each weight of a deep set lies in one flat vector of parameters.
///
/// Training works on that vector: gradients, moments of the optimiser and checkpoints are vectors of the same length,
/// and only the networks' arithmetic needs to know what stands where.
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "nn/weights/function_id.h"
#include "nn/weights/weights.h"

namespace swarmcert::training {

using Matrix = Eigen::MatrixXf;  ///< one column per sample
using Vector = Eigen::VectorXf;

/// One multilayer perceptron of the set: "phi:small" or "rho:small".
struct Part {
  files::FunctionId id;    ///< a phi or a rho
  std::vector<int> sizes;  ///< inputs, hidden layers, outputs
  Eigen::Index begin = 0;  ///< first parameter: per layer W (column-major, [outputs x inputs]), then b
  /// Which inputs are x and y of one vector in the world frame: see turn_about_vertical().
  std::vector<std::array<int, 2>> horizontal = {};

  int layers() const { return static_cast<int>(sizes.size()) - 1; }
  int inputs() const { return sizes.front(); }
  int outputs() const { return sizes.back(); }
};

/// Parts and their places. Value type; the views refer to the vector that is passed in.
class Layout {
 public:
  Layout() = default;
  /// @throws std::invalid_argument if a part has no layer or a size that is not positive.
  explicit Layout(std::vector<Part> parts);

  Eigen::Index size() const { return size_; }
  const std::vector<Part>& parts() const { return parts_; }
  /// Index of a part; -1 if there is none such.
  int find(const files::FunctionId& id) const;

  Eigen::Map<Matrix> weights(Vector& theta, int part, int layer) const;
  Eigen::Map<const Matrix> weights(const Vector& theta, int part, int layer) const;
  Eigen::Map<Vector> biases(Vector& theta, int part, int layer) const;
  Eigen::Map<const Vector> biases(const Vector& theta, int part, int layer) const;

  /// The part as it is stored: float32, layers named "fc1", "fc2", ...
  files::Weights stored(const Vector& theta, int part) const;

  /// The reverse of stored(): the part's place in `theta` takes the values of `weights`.
  /// @throws std::invalid_argument if the sizes differ.
  void load(Vector& theta, int part, const files::Weights& weights) const;

 private:
  Eigen::Index offset(int part, int layer) const;

  std::vector<Part> parts_;
  Eigen::Index size_ = 0;
};

/// Weights and biases uniform in +-1 / sqrt(inputs of the layer), the usual start for ReLU networks.
Vector initial_parameters(const Layout& layout, std::uint64_t seed);

}  // namespace swarmcert::training
