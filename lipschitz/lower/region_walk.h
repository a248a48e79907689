/// @file Best-first search over the linear regions of a ReLU network for one with a large Jacobian.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <queue>
#include <unordered_set>
#include <vector>

#include "lipschitz/base/stop.h"
#include "lipschitz/lower/linear_region.h"
#include "lipschitz/lower/search_network.h"
#include "nn/base/random.h"

namespace swarmcert::lipschitz {

/// Maximises the local slope by walking from linear region to linear region.
///
/// A walk starts at the steepest of some random points. Regions that were seen but not entered are kept in a queue, and
/// the steepest one is entered next. The walk moves to the analytic centre of that region: the minimiser of
/// -sum_i log|y_i| minus the logarithms of the distances to the bounds, or plus |z|^2 / R^2 if there are no bounds.
/// From there it shoots a ray at every kink along H^-1 dy_i/dz, where H is the Hessian of the barrier, a metric in
/// which narrow regions are round. The first kink on a ray is a facet. Crossing it switches one neuron i, so the
/// Jacobian behind it is J +- df/dh_i (dy_i/dz)' and needs no further evaluation of the network.
///
/// Kinks of neighbours that do not move do not change the Jacobian. Rays pass through them, and regions that differ
/// only in such neurons count as one; otherwise a walk would visit too many regions of equal slope. Behind such kinks
/// the estimate is rough, so the slope of every region is evaluated before it is entered; if it is then no longer the
/// steepest, the region returns to the queue.
///
/// If the domain is unbounded, walks start among the kinks of the first layer, or far from them: alternately at
/// geometrically spaced scales and at infinity. Along a ray x + t d, t -> inf, f has the slopes of the chain without
/// its biases, whose linear regions are cones; the walk starts far out along the steepest of some random directions.
///
/// A walk ends after kPatience successive regions that are no steeper than its best one. No region is entered twice.
///
/// The slope found is an estimate, not a bound; its distance from the maximum is not bounded.
class RegionWalk {
 public:
  /// A region's analytic centre and its slope.
  struct Found {
    Eigen::VectorXd z;
    double slope = -1;
  };

  /// Where walks start.
  enum class Where { kAmongKinks, kFarOut };

  /// @param starts values of the moved vector at which the first walks start; the other neighbours are placed at the
  ///   steepest of some random points.
  RegionWalk(const SearchNetwork& network, std::uint64_t seed,
             const std::vector<Eigen::VectorXd>& starts = {}, Where where = Where::kAmongKinks);

  /// Enters up to `regions` regions, continuing the current walk and starting new ones.
  /// @returns false if it was stopped before that.
  bool enter(int regions, const Stop& stop);

  /// Returns the steepest regions so far, steepest first, at most kKept; empty before the first enter().
  const std::vector<Found>& steepest() const { return steepest_; }

  static constexpr std::size_t kKept = 4;

 private:
  struct Candidate {
    double slope;
    Eigen::VectorXd z;
    bool evaluated;  ///< true: `slope` is the slope at z; false: an estimate from the adjacent region
    bool operator<(const Candidate& other) const { return slope < other.slope; }
  };

  /// Returns a random point of the domain. Unbounded variables are at a random distance from the centre between
  /// `nearest` and `farthest`.
  Eigen::VectorXd random_point(double nearest, double farthest);
  /// Sets the variables of z from index `first` on to the values in `inputs` = (x, x_1, ...), as far as `inputs` reach.
  void move_to(const Eigen::VectorXd& inputs, Eigen::VectorXd& z, int first = 0) const;
  void start_walk();
  /// Returns the steepest of some random_point(nearest, farthest).
  Candidate steepest_start(double nearest, double farthest);
  Candidate start_at_infinity();
  /// Takes the candidate from the queue that is steepest after evaluation. Returns false if it was entered before.
  bool take_steepest(Eigen::VectorXd& z);
  void enter(Eigen::VectorXd z);
  void keep(const Eigen::VectorXd& z, double slope);
  void queue_neighbours(const LinearRegion& region, const Eigen::VectorXd& z);
  struct Hit;
  Hit first_hit(const Eigen::VectorXd& rates, const Eigen::VectorXd& ray, const Eigen::VectorXd& z) const;
  /// Returns a lower bound on the slope behind the facet of `neuron`, from the Gram matrix of this region and its top
  /// eigenvector.
  double slope_behind(const LinearRegion& region, Eigen::Index neuron, const Eigen::MatrixXd& square,
                      const Eigen::VectorXd& top) const;

  const SearchNetwork& network_;
  files::Random random_;
  std::vector<Eigen::VectorXd> starts_;  ///< unused starts, the next one last
  bool all_move_;  ///< every neuron depends on the moved vector, so that slopes behind a facet are exact
  std::optional<SearchNetwork> recession_;  ///< for walks far out: the chain without its biases
  int walks_ = 0;
  double reach_ = 1;  ///< R of the current walk
  std::priority_queue<Candidate> queue_;
  std::unordered_set<std::uint64_t> queued_;   ///< patterns queued in the current walk
  std::unordered_set<std::uint64_t> entered_;  ///< patterns entered in any walk
  double best_of_walk_ = -1;
  int entered_in_vain_ = 0;
  std::vector<Found> steepest_;
};

}  // namespace swarmcert::lipschitz
