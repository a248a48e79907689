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
/// A walk starts at the steepest of some random points. It keeps what it has seen but not entered in a queue and
/// enters the steepest: it moves to the analytic centre of that region (the minimiser of -sum_i log|y_i| minus the
/// logarithms of the distances to the bounds, or plus |z|^2 / R^2 where there are none), and from there shoots a ray
/// at every kink, along H^-1 dy_i/dz with the Hessian H of that barrier, which sees narrow regions as round. The
/// first kink on a ray is a facet; crossing it switches one neuron i, so that the Jacobian behind it is
/// J +- df/dh_i (dy_i/dz)', without another evaluation of the network.
///
/// Kinks of neighbours that do not move leave the Jacobian as it is. Rays pass through them, and regions that differ
/// in them alone count as one; otherwise a walk would drown in regions of equal slope. Behind such kinks the estimate
/// is rough, so every region's slope is evaluated before it is entered, and it goes back into the queue where that
/// is not the steepest after all.
///
/// Where the domain is open, walks start among the kinks of the first layer or, far from them, in turn on a ladder of
/// scales and at infinity: along a ray x + t d, t -> inf, f has the slopes of the chain without its biases, whose
/// linear regions are cones; the walk starts far out along the steepest of some random directions.
///
/// A walk ends when kPatience regions in a row were no steeper than its best one; regions once entered are not
/// entered again.
///
/// The slope found is an estimate, not a bound; nothing limits how far it is from the maximum.
class RegionWalk {
 public:
  /// A region's analytic centre and its slope.
  struct Found {
    Eigen::VectorXd z;
    double slope = -1;
  };

  /// Where walks start.
  enum class Where { kAmongKinks, kFarOut };

  /// @param starts moved vectors at which the first walks start; the other neighbours are where the slope is steepest
  ///   among some random places.
  RegionWalk(const SearchNetwork& network, std::uint64_t seed,
             const std::vector<Eigen::VectorXd>& starts = {}, Where where = Where::kAmongKinks);

  /// Points (x, x_1, ...) of the moved vector and of the first few others: every walk may start there as well, or
  /// elsewhere with these others.
  void set_places(std::vector<Eigen::VectorXd> places) { places_ = std::move(places); }

  /// Enters up to `regions` regions, continuing the current walk and starting new ones.
  /// @returns whether it went through with that, rather than stop.
  bool enter(int regions, const Stop& stop);

  /// The steepest regions so far, steepest first, at most kKept; empty before the first enter().
  const std::vector<Found>& steepest() const { return steepest_; }

  static constexpr std::size_t kKept = 4;

 private:
  struct Candidate {
    double slope;
    Eigen::VectorXd z;
    bool evaluated;  ///< whether `slope` is the slope at z, or an estimate from the region next to it
    bool operator<(const Candidate& other) const { return slope < other.slope; }
  };

  /// A point of the domain; open variables at a random distance from the centre, between these two.
  Eigen::VectorXd random_point(double nearest, double farthest);
  /// Puts the variables of (x, x_1, ...), from the one at `first` on and as far as `inputs` go, where these are.
  void move_to(const Eigen::VectorXd& inputs, Eigen::VectorXd& z, int first = 0) const;
  void start_walk();
  /// The steepest of some points of the domain at distances between these two.
  Candidate steepest_start(double nearest, double farthest);
  Candidate start_at_infinity();
  /// Takes the steepest candidate from the queue, once evaluated; false where it was entered before.
  bool take_steepest(Eigen::VectorXd& z);
  void enter(Eigen::VectorXd z);
  void keep(const Eigen::VectorXd& z, double slope);
  void queue_neighbours(const LinearRegion& region, const Eigen::VectorXd& z);
  struct Hit;
  Hit first_hit(const Eigen::VectorXd& rates, const Eigen::VectorXd& ray, const Eigen::VectorXd& z) const;
  /// Slope behind the facet of `neuron`, from the Gram matrix here and its top eigenvector: at most the true one.
  double slope_behind(const LinearRegion& region, Eigen::Index neuron, const Eigen::MatrixXd& square,
                      const Eigen::VectorXd& top) const;

  const SearchNetwork& network_;
  files::Random random_;
  std::vector<Eigen::VectorXd> starts_;  ///< still to be used, the first one last
  std::vector<Eigen::VectorXd> places_;
  bool all_move_;  ///< every neuron depends on the moved vector, so that what lies behind a facet is exact
  std::optional<SearchNetwork> recession_;  ///< of walks far out: the chain without its biases
  int walks_ = 0;
  double reach_ = 1;  ///< R of the current walk
  std::priority_queue<Candidate> queue_;
  std::unordered_set<std::uint64_t> queued_;   ///< in the current walk
  std::unordered_set<std::uint64_t> entered_;  ///< in any walk
  double best_of_walk_ = -1;
  int entered_in_vain_ = 0;
  std::vector<Found> steepest_;
};

}  // namespace swarmcert::lipschitz
