/// @file Maps the weights of a deep set to positions in one flat parameter vector.
///
/// Training works on that vector: gradients, optimiser moments and checkpoints are vectors of the same length, and only
/// the evaluation of the networks needs to know the position of each weight.
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

/// One multilayer perceptron of the deep set: "phi:small" or "rho:small".
struct Part {
  files::FunctionId id;    ///< a phi or a rho
  std::vector<int> sizes;  ///< inputs, hidden layers, outputs
  Eigen::Index begin = 0;  ///< first parameter: per layer W (column-major, [outputs x inputs]), then b
  /// Pairs of inputs that are the x and y components of one vector in the world frame: see turn_about_vertical().
  std::vector<std::array<int, 2>> horizontal = {};

  int layers() const { return static_cast<int>(sizes.size()) - 1; }
  int inputs() const { return sizes.front(); }
  int outputs() const { return sizes.back(); }
};

/// The parts and their positions. Value type; the returned maps refer to the vector that is passed in.
class Layout {
 public:
  Layout() = default;
  /// @throws std::invalid_argument if a part has no layer or a size that is not positive.
  explicit Layout(std::vector<Part> parts);

  Eigen::Index size() const { return size_; }
  const std::vector<Part>& parts() const { return parts_; }
  /// Returns the index of a part; -1 if there is no such part.
  int find(const files::FunctionId& id) const;

  Eigen::Map<Matrix> weights(Vector& theta, int part, int layer) const;
  Eigen::Map<const Matrix> weights(const Vector& theta, int part, int layer) const;
  Eigen::Map<Vector> biases(Vector& theta, int part, int layer) const;
  Eigen::Map<const Vector> biases(const Vector& theta, int part, int layer) const;

  /// Returns the part in the form in which it is stored: float32, layers named "fc1", "fc2", ...
  files::Weights stored(const Vector& theta, int part) const;

  /// Inverse of stored(): copies `weights` to the part's position in `theta`.
  /// @throws std::invalid_argument if the sizes differ.
  void load(Vector& theta, int part, const files::Weights& weights) const;

 private:
  Eigen::Index offset(int part, int layer) const;

  std::vector<Part> parts_;
  Eigen::Index size_ = 0;
};

/// Returns weights and biases that are uniform in +-1 / sqrt(inputs of the layer), as is usual for ReLU networks.
Vector initial_parameters(const Layout& layout, std::uint64_t seed);

}  // namespace swarmcert::training
