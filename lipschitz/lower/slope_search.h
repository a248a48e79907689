/// @file Search for a steep pair of points, which gives a lower bound on the Lipschitz constant of a ReLU network.
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

/// Takes about a second for the sizes of the published networks (6-25-40-40-20, 20-40-40-40-1).
inline constexpr int kDefaultSearchRounds = 40;

/// Linear regions that one round of search_slope() enters.
inline constexpr int kRegionsPerRound = 100;
/// Additional regions per round far from the kinks of the first layer, if the domain is unbounded.
inline constexpr int kFarRegionsPerRound = 50;

struct SlopeSearchOptions {
  std::uint64_t seed = 1;
  int rounds = kDefaultSearchRounds;  ///< number of rounds of kRegionsPerRound linear regions, at least 1
  /// Wall-clock limit; 0: no limit. A round that is cut short is discarded unless it is the first, so that the result
  /// depends only on the number of complete rounds.
  double seconds = 0;

  std::optional<Box> box;  ///< box that must contain x and y; nothing: unbounded
  /// Boxes that must contain the other neighbours, one entry per term of SlopeFunction::others. May be empty
  /// (unbounded) only if `box` is not set either, because a bound for a box must not use neighbours outside of their
  /// boxes.
  std::vector<std::optional<Box>> other_boxes;
  std::vector<int> block;  ///< coordinates of x that move; empty: all

  /// Points x at which the first walks start instead of at random points, [inputs of the moved network] each.
  std::vector<Eigen::VectorXd> starts;

  const std::atomic<bool>* cancelled = nullptr;  ///< ends the search early, like `seconds`
  /// Called after each round with the steepest slope so far.
  std::function<void(int rounds_done, Estimate steepest)> progress;
};

/// Result of a search. The slope between the points, |f(x) - f(y)|_2 / |x - y|_2, is at least `slope` in exact
/// arithmetic (see lipschitz::slope()), so `slope` is a lower bound on every Lipschitz constant of f over the boxes.
struct SlopeWitness : SlopePoints {
  LowerBound slope{0};  ///< output units per input unit
  int rounds_done = 0;
  bool interrupted = false;  ///< stopped before all rounds were done
};

/// Searches for points x, y in the box (equal outside the block) and points of the other neighbours in their boxes
/// between which f is steepest. Maximises the largest singular value of df/dx_block over the linear regions of f (see
/// RegionWalk), then places x and y in the steepest regions along the singular direction, in float32.
///
/// Runs on one thread. If seconds is not set, equal options give identical bits on the same machine.
/// The slope is 0 if f does not depend on the block or if the boxes contain no two float32 points that differ in the
/// block only; in the latter case x and y are empty.
/// @throws std::invalid_argument if an activation is not ReLU, the sizes of the function do not match, rounds is
///   below 1, seconds is negative or NaN, a box has the wrong size, is empty, contains NaN or is unbounded
///   on one side only, other_boxes is missing or has the wrong size, a start has the wrong size, or block contains a
///   coordinate twice or one that does not exist.
SlopeWitness search_slope(const SlopeFunction& f, const SlopeSearchOptions& options = {});

}  // namespace swarmcert::lipschitz
