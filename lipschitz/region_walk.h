/// @file Best-first search over the linear regions of a ReLU network for one with a large Jacobian.
#pragma once

#include <Eigen/Core>
#include <atomic>
#include <cstdint>
#include <queue>
#include <unordered_set>
#include <vector>

#include "lipschitz/search_network.h"

namespace swarmcert::lipschitz {

/// Pseudo-random numbers with the same bits everywhere (splitmix64, Steele et al. 2014).
class SearchRandom {
 public:
  explicit SearchRandom(std::uint64_t seed) : state_(seed) {}
  std::uint64_t bits();
  /// Uniform in [0, 1).
  double uniform();
  /// Sum of twelve uniform numbers, minus 6: variance 1, near enough to a normal distribution, and no libm in it.
  double bell();

 private:
  std::uint64_t state_;
};

/// The network around a point z: on its linear region, f(z') = f(z) + J (z' - z).
struct LinearRegion {
  Eigen::VectorXd
      distances;  ///< [neurons] y_i / |dy_i/dz|: signed distance to neuron i's kink; 0 where it has none
  Eigen::MatrixXd
      normals;  ///< [variables x neurons] dy_i/dz, normalised; zero columns where there is no kink
  Eigen::VectorXd lengths;  ///< [neurons] |dy_i/dz|
  Eigen::MatrixXd effects;  ///< [outputs x neurons] df/dh_i of the neuron's output h_i
  Eigen::MatrixXd
      jacobian;           ///< [outputs x block] with respect to the inputs in the block, in their own units
  std::vector<char> on;   ///< [neurons]
  std::uint64_t pattern;  ///< hash of `on`
};

/// The linear region that z lies in (at a kink, the neuron counts as off).
LinearRegion linear_region(const SearchNetwork& network, const Eigen::VectorXd& z);

/// The largest singular value of the Jacobian at z with respect to the block (an estimate, not proven).
double local_slope(const SearchNetwork& network, const Eigen::VectorXd& z);

/// How far z + t * direction stays in the region and, where variables have bounds, within them: lower < 0 < upper.
struct Chord {
  double lower, upper;
};
Chord chord(const SearchNetwork& network, const LinearRegion& region, const Eigen::VectorXd& z,
            const Eigen::VectorXd& direction);

/// Maximises the local slope by walking from linear region to linear region.
///
/// A walk starts at the steepest of some random points. It keeps the regions that it has seen but not entered in a
/// queue and enters the steepest one: it moves to the analytic centre of that region (the minimiser of
/// -sum_i log|y_i| minus the logarithms of the distances to the bounds, or plus |z|^2 / R^2 where there are none),
/// and from there shoots a ray at every kink, along H^-1 dy_i/dz with the Hessian H of that barrier, which sees
/// narrow regions as round. The first kink on a ray is a facet; crossing it switches one neuron i, so that the
/// Jacobian behind it is J +- df/dh_i (dy_i/dz)', without another evaluation of the network. A walk ends when
/// kPatience regions in a row were no steeper than the best one; regions once entered are not entered again.
///
/// The slope found is an estimate, not a bound; nothing limits how far it is from the maximum.
class RegionWalk {
 public:
  /// A region's analytic centre and its slope.
  struct Found {
    Eigen::VectorXd z;
    double slope = -1;
  };

  RegionWalk(const SearchNetwork& network, std::uint64_t seed);

  /// Enters up to `regions` regions, continuing the current walk and starting new ones. Stops early if `cancelled`.
  void enter(int regions, const std::atomic<bool>* cancelled);

  /// The steepest regions so far, steepest first, at most kKept; empty before the first enter().
  const std::vector<Found>& steepest() const { return steepest_; }

  static constexpr std::size_t kKept = 4;

 private:
  struct Candidate {
    double slope;  ///< estimate from the region next to it
    Eigen::VectorXd z;
    bool operator<(const Candidate& other) const { return slope < other.slope; }
  };

  Eigen::VectorXd random_point();
  void start_walk();
  void enter_steepest();
  void keep(const Eigen::VectorXd& z, double slope);
  void queue_neighbours(const LinearRegion& region, const Eigen::VectorXd& z);

  const SearchNetwork& network_;
  SearchRandom random_;
  double reach_ = 1;  ///< R of the current walk
  std::priority_queue<Candidate> queue_;
  std::unordered_set<std::uint64_t> queued_;   ///< in the current walk
  std::unordered_set<std::uint64_t> entered_;  ///< in any walk
  double best_of_walk_ = -1;
  int entered_in_vain_ = 0;
  std::vector<Found> steepest_;
};

}  // namespace swarmcert::lipschitz
