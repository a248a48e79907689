/// @file The function whose slope is maximised, as one dense ReLU chain in normalised coordinates.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "lipschitz/base/box.h"
#include "lipschitz/checker/witness.h"

namespace swarmcert::lipschitz {

/// One stage y = W z + b of the chain.
struct SearchStage {
  Eigen::MatrixXd weights;
  Eigen::VectorXd biases;
  /// Per neuron: whether it passes y_i on unchanged. Such neurons carry a value past the stages of deeper neighbours
  /// and have no kink.
  std::vector<char> passes;
  /// The first `moved` neurons depend on the moved vector. The other neurons do not, and their kinks do not change the
  /// slope.
  int moved = 0;
};

/// The function of a search. Its weights were multiplied out in double, because a search only proposes points.
///
/// The variables z are the input coordinates that the domain does not fix, first those of the moved vector and then
/// those of the other neighbours in order: x = centre + scale * z, coordinate by coordinate. A coordinate in an
/// interval has -1 <= z <= 1. For an unbounded coordinate, centre and scale are chosen from the kinks of the first
/// stage, so that the search does not depend on the units of the inputs.
struct SearchNetwork {
  std::vector<SearchStage> stages;
  Eigen::VectorXd centre, scale;
  std::vector<char> boxed;  ///< per variable: -1 <= z <= 1
  /// Variables with respect to which f is differentiated, ascending; they belong to the moved vector.
  std::vector<int> block;
  std::vector<int>
      coordinate;  ///< per variable: its index in (x, x_1, x_2, ...), the inputs one after the other
  Eigen::VectorXd fixed_inputs;  ///< (x, x_1, x_2, ...), with the values of coordinates that are fixed
  int moved_inputs = 0;          ///< length of x

  int variables() const { return static_cast<int>(coordinate.size()); }
  int moved_variables() const;
  int outputs() const { return static_cast<int>(stages.back().weights.rows()); }
  int neurons() const;  ///< number of neurons in hidden stages, including those that pass

  /// Returns (x, x_1, x_2, ...) at z.
  Eigen::VectorXd inputs(const Eigen::VectorXd& z) const;
  /// Returns f, up to round-off, at (x, x_1, x_2, ...) = `inputs`, which must agree with `fixed_inputs` in coordinates
  /// that are not variables.
  Eigen::VectorXd value(const std::vector<float>& inputs) const;
};

/// Builds the chain. The networks of a deep set are placed side by side, and their last layers are multiplied by the
/// first layer of rho. With a clamp, the domain is restricted to the clamp's range, because f is constant outside.
/// @param boxes one per vector (x, x_1, x_2, ...); nothing: all of R^n.
/// @param block coordinates of x; empty: all.
/// Precondition: check_function(f) accepts f, and boxes and block fit it.
SearchNetwork search_network(const SlopeFunction& f, const std::vector<std::optional<Box>>& boxes,
                             const std::vector<int>& block);

}  // namespace swarmcert::lipschitz
