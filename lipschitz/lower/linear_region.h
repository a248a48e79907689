/// @file A ReLU network around one point: its linear region, its Jacobian, its kinks.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "lipschitz/lower/search_network.h"

namespace swarmcert::lipschitz {

/// The network around a point z: on its linear region, f(z') = f(z) + J (z' - z).
struct LinearRegion {
  Eigen::VectorXd
      distances;            ///< [neurons] y_i / |dy_i/dz|: signed distance to neuron i's kink; 0: it has none
  Eigen::MatrixXd normals;  ///< [variables x neurons] dy_i/dz, normalised; zero where there is no kink
  Eigen::VectorXd lengths;  ///< [neurons] |dy_i/dz|
  Eigen::MatrixXd effects;  ///< [outputs x neurons] df/dh_i of the neuron's output h_i
  Eigen::MatrixXd
      jacobian;             ///< [outputs x block] with respect to the inputs in the block, in their own units
  std::vector<char> on;     ///< [neurons]
  std::vector<char> moved;  ///< [neurons] whether the neuron depends on the moved vector
  std::uint64_t pattern = 0;  ///< hash of `on`, of the neurons that depend on the moved vector
};

/// The linear region that z lies in (at a kink, the neuron counts as off).
LinearRegion linear_region(const SearchNetwork& network, const Eigen::VectorXd& z);

/// The largest singular value of the Jacobian at z with respect to the block (an estimate, not proven), and the hash
/// of the pattern there, see LinearRegion.
struct LocalSlope {
  double slope;
  std::uint64_t pattern;
};
LocalSlope local_slope(const SearchNetwork& network, const Eigen::VectorXd& z);

/// How far z + t * direction stays in the region and, where variables have bounds, within them: lower < 0 < upper.
struct Chord {
  double lower, upper;
};
Chord chord(const SearchNetwork& network, const LinearRegion& region, const Eigen::VectorXd& z,
            const Eigen::VectorXd& direction);

/// Columns of `full` [any x variables] that belong to the block, per unit of the inputs.
Eigen::MatrixXd block_columns(const SearchNetwork& network, const Eigen::MatrixXd& full);

/// J'J or JJ', whichever is smaller.
Eigen::MatrixXd gram(const Eigen::MatrixXd& jacobian);

/// The hash of a pattern is the exclusive or of its active neurons' keys.
std::uint64_t pattern_key(int neuron);

}  // namespace swarmcert::lipschitz
