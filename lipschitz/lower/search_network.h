/// @file The function whose slope is searched, as one dense ReLU chain in normalised coordinates.
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
  /// Per neuron: hands y_i on unchanged. It carries a value past the stages of deeper neighbours, without a kink.
  std::vector<char> passes;
  /// The first `moved` neurons depend on the moved vector. The others cannot, nor can their kinks change the slope.
  int moved = 0;
};

/// What a search works on. Its weights were multiplied out in double: a search only proposes points.
///
/// The variables z are the input coordinates that the domain leaves free, of the moved vector first and then of the
/// other neighbours, one by one: x = centre + scale * z, coordinate by coordinate. A coordinate in an interval has
/// -1 <= z <= 1; for an open one, centre and scale follow from where the first stage has its kinks, so that the
/// search does not depend on the inputs' units.
struct SearchNetwork {
  std::vector<SearchStage> stages;
  Eigen::VectorXd centre, scale;
  std::vector<char> boxed;  ///< per variable: -1 <= z <= 1
  /// Variables with respect to which f is differentiated, ascending; they belong to the moved vector.
  std::vector<int> block;
  std::vector<int>
      coordinate;  ///< per variable: its index in (x, x_1, x_2, ...), the inputs one after the other
  Eigen::VectorXd fixed_inputs;  ///< (x, x_1, x_2, ...), with values where a coordinate is not a variable
  int moved_inputs = 0;          ///< length of x

  int variables() const { return static_cast<int>(coordinate.size()); }
  int moved_variables() const;
  int outputs() const { return static_cast<int>(stages.back().weights.rows()); }
  int neurons() const;  ///< in hidden stages, those that pass included

  /// (x, x_1, x_2, ...) at z.
  Eigen::VectorXd inputs(const Eigen::VectorXd& z) const;
  /// f, up to rounding, at (x, x_1, x_2, ...) = `inputs`, which agree with `fixed_inputs` where they are no variables.
  Eigen::VectorXd value(const std::vector<float>& inputs) const;
};

/// Builds the chain: the networks of a deep set side by side, their last layers and rho's first one multiplied out.
/// Where a clamp acts, the domain is what it lets through: f is constant beyond.
/// @param boxes one per vector (x, x_1, x_2, ...); nothing: all of R^n.
/// @param block coordinates of x; empty: all.
/// Precondition: check_function(f) accepts f, and boxes and block fit it.
SearchNetwork search_network(const SlopeFunction& f, const std::vector<std::optional<Box>>& boxes,
                             const std::vector<int>& block);

}  // namespace swarmcert::lipschitz
