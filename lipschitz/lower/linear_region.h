/// @file A ReLU network near one point: its linear region, Jacobian and kinks.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "lipschitz/lower/search_network.h"

namespace swarmcert::lipschitz {

/// The network near a point z: on the linear region of z, f(z') = f(z) + J (z' - z).
struct LinearRegion {
  Eigen::VectorXd
      distances;  ///< [neurons] y_i / |dy_i/dz|: signed distance to neuron i's kink; 0 if it has none
  Eigen::MatrixXd normals;    ///< [variables x neurons] dy_i/dz, normalised; zero if there is no kink
  Eigen::VectorXd lengths;    ///< [neurons] |dy_i/dz|
  Eigen::MatrixXd effects;    ///< [outputs x neurons] df/dh_i of the neuron's output h_i
  Eigen::MatrixXd jacobian;   ///< [outputs x block] with respect to the inputs in the block, in their units
  std::vector<char> on;       ///< [neurons]
  std::vector<char> moved;    ///< [neurons] whether the neuron depends on the moved vector
  std::uint64_t pattern = 0;  ///< hash of `on` over the neurons that depend on the moved vector
};

/// Returns the linear region that contains z. A neuron at its kink counts as off.
LinearRegion linear_region(const SearchNetwork& network, const Eigen::VectorXd& z);

/// The largest singular value of the Jacobian at z with respect to the block (an estimate without proof), and the hash
/// of the activation pattern at z (see LinearRegion).
struct LocalSlope {
  double slope;
  std::uint64_t pattern;
};
LocalSlope local_slope(const SearchNetwork& network, const Eigen::VectorXd& z);

/// The range of t for which z + t * direction stays in the region and within the bounds of the variables:
/// lower < 0 < upper.
struct Chord {
  double lower, upper;
};
Chord chord(const SearchNetwork& network, const LinearRegion& region, const Eigen::VectorXd& z,
            const Eigen::VectorXd& direction);

/// Returns the columns of `full` [any x variables] that belong to the block, converted to units of the inputs.
Eigen::MatrixXd block_columns(const SearchNetwork& network, const Eigen::MatrixXd& full);

/// Returns J'J or JJ', whichever is smaller.
Eigen::MatrixXd gram(const Eigen::MatrixXd& jacobian);

/// Returns the key of a neuron. The hash of a pattern is the exclusive or of the keys of its active neurons.
std::uint64_t pattern_key(int neuron);

}  // namespace swarmcert::lipschitz
