/// @file Search for a steep pair of points: the lower bounds on Lipschitz constants.
#pragma once

#include <Eigen/Core>
#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "lipschitz/base/box.h"
#include "lipschitz/checker/bounds.h"
#include "lipschitz/checker/witness.h"

namespace swarmcert::lipschitz {

/// About a second for the published networks' sizes (6-25-40-40-20, 20-40-40-40-1).
inline constexpr int kDefaultSearchRounds = 40;

/// Linear regions that one round of search_slope() enters.
inline constexpr int kRegionsPerRound = 100;
/// And as many more far from the kinks of the first layer, where the domain is open.
inline constexpr int kFarRegionsPerRound = 50;

struct SlopeSearchOptions {
  std::uint64_t seed = 1;
  int rounds = kDefaultSearchRounds;  ///< of kRegionsPerRound linear regions each, at least 1
  /// Wall clock; 0: no limit. A round that it cuts short counts for nothing, unless it is the first: what was found is
  /// what as many rounds find.
  double seconds = 0;

  std::optional<Box> box;  ///< where x and y must lie; nothing: anywhere
  /// Where the other neighbours must lie, one entry per term of SlopeFunction::others. May only be left empty
  /// (anywhere) where `box` is not set either: a bound for a box must not rest on neighbours outside of theirs.
  std::vector<std::optional<Box>> other_boxes;
  std::vector<int> block;  ///< coordinates of x that move; empty: all

  /// Points x where the first walks start instead of at random ones, [inputs of the moved network] each.
  std::vector<Eigen::VectorXd> starts;
  /// Where f was found steep on other boxes, (x, x_1, x_2, ...) of the moved vector and of the first few others: walks
  /// start there too, put into the boxes.
  std::vector<Eigen::VectorXd> places;
  int regions = kRegionsPerRound;  ///< that a round enters, at least 1; besides those far from the kinks

  const std::atomic<bool>* cancelled = nullptr;  ///< ends the search early, as `seconds` does
  /// Called after each round with the steepest slope so far.
  std::function<void(int rounds_done, Estimate steepest)> progress;
};

/// What a search found. The slope of the points, |f(x) - f(y)|_2 / |x - y|_2, is at least `slope` in exact arithmetic
/// (see lipschitz::slope()), so `slope` is a lower bound on every Lipschitz constant of f over the boxes.
struct SlopeWitness : SlopePoints {
  LowerBound slope{0};  ///< output units per input unit
  int rounds_done = 0;
  bool interrupted = false;  ///< stopped before all rounds were done
};

/// Looks for the points x, y in the box (equal outside the block), and the points of the other neighbours in theirs,
/// between which f is steepest: it maximises the largest singular value of df/dx_block over the linear regions of f
/// (see RegionWalk), then places x and y in the steepest regions along the singular direction, in float32.
///
/// The same options (seconds unset) give the same bits on the same machine; one thread.
/// Where f does not depend on the block, and where the boxes hold no two float32 points that differ in the block only,
/// the slope is 0; in the latter case there are no points either (x and y are empty).
/// @throws std::invalid_argument if an activation is not ReLU, the function's sizes do not fit, rounds or regions are
///   below 1, seconds is negative or NaN, a box has the wrong size, is empty, NaN or open to one side only, other_boxes
///   is missing or has the wrong size, a start has the wrong size, or block names a coordinate twice or one that does
///   not exist.
SlopeWitness search_slope(const SlopeFunction& f, const SlopeSearchOptions& options = {});

}  // namespace swarmcert::lipschitz
