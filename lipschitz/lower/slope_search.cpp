#include "lipschitz/lower/slope_search.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "lipschitz/base/stop.h"
#include "lipschitz/lower/linear_region.h"
#include "lipschitz/lower/region_walk.h"
#include "lipschitz/lower/search_network.h"
#include "lipschitz/solver/dense_kernels.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Lengths of the pairs to try, relative to the chord of the region through its centre. Pairs longer than the chord
/// leave the region; they are for regions that are too small for float32.
constexpr double kPairLengths[] = {0.9, 0.5, 0.2, 1.5, 4};
/// Infinite chords are cut at this length, in normalised coordinates.
constexpr double kLongestChord = 16;

[[noreturn]] void refuse(const std::string& what) { throw std::invalid_argument("search_slope: " + what); }

void check_box(const Box& box, const Term& term, const std::string& name) {
  const auto inputs = static_cast<std::size_t>(term.network->inputs());
  if (box.lower.size() != inputs || box.upper.size() != inputs) {
    refuse(name + " needs " + std::to_string(inputs) + " intervals");
  }
  for (std::size_t k = 0; k < inputs; ++k) {
    const std::string interval = "interval " + std::to_string(k) + " of " + name;
    if (!(box.lower[k] <= box.upper[k])) refuse(interval + " is empty");
    if (std::isinf(box.lower[k]) && std::isinf(box.upper[k]) && box.lower[k] < box.upper[k]) continue;
    if (std::isinf(box.lower[k]) || std::isinf(box.upper[k]))
      refuse(interval + " is unbounded on one side only");
  }
}

/// Validates the arguments and returns the boxes of (x, x_1, x_2, ...).
std::vector<std::optional<Box>> check(const SlopeFunction& f, const SlopeSearchOptions& options) {
  check_function(f);
  if (!is_relu(f)) refuse("an activation is not ReLU");
  if (options.rounds < 1) refuse("rounds = " + std::to_string(options.rounds) + " is below 1");
  if (!(options.seconds >= 0)) refuse("seconds = " + std::to_string(options.seconds) + " is negative");
  for (const VectorXd& start : options.starts) {
    if (start.size() != f.moved.network->inputs())
      refuse("a start has " + std::to_string(start.size()) + " inputs instead of " +
             std::to_string(f.moved.network->inputs()));
  }
  std::vector<int> block = options.block;
  std::sort(block.begin(), block.end());
  if (std::adjacent_find(block.begin(), block.end()) != block.end()) refuse("block names a coordinate twice");
  if (!block.empty() && (block.front() < 0 || block.back() >= f.moved.network->inputs())) {
    refuse("block names a coordinate that does not exist");
  }
  std::vector<std::optional<Box>> boxes = {options.box};
  boxes.insert(boxes.end(), options.other_boxes.begin(), options.other_boxes.end());
  if (!options.box && options.other_boxes.empty()) boxes.resize(f.others.size() + 1);
  if (boxes.size() != f.others.size() + 1) {
    refuse(std::to_string(options.other_boxes.size()) + " boxes for " + std::to_string(f.others.size()) +
           " other neighbours");
  }
  for (std::size_t j = 0; j < boxes.size(); ++j) {
    if (boxes[j]) check_box(*boxes[j], j == 0 ? f.moved : f.others[j - 1], "box " + std::to_string(j));
  }
  return boxes;
}

/// The float32 numbers of an interval, from `least` to `greatest`; empty if least > greatest.
struct FloatInterval {
  float least = std::numeric_limits<float>::lowest();
  float greatest = std::numeric_limits<float>::max();
};
FloatInterval floats_within(double lower, double upper) {
  const float infinity = std::numeric_limits<float>::infinity();
  constexpr double kMax = std::numeric_limits<float>::max();
  FloatInterval result{static_cast<float>(std::clamp(lower, -kMax, kMax)),
                       static_cast<float>(std::clamp(upper, -kMax, kMax))};
  if (static_cast<double>(result.least) < lower) result.least = std::nextafter(result.least, infinity);
  if (static_cast<double>(result.greatest) > upper)
    result.greatest = std::nextafter(result.greatest, -infinity);
  return result;
}

/// Pairs whose slopes in double agree to this relative accuracy are compared exactly.
constexpr double kSameSlope = 1e-9;

/// Rounds points of the search to float32 points of the boxes and finds the steepest pair, by exact comparison if
/// double precision is not sufficient.
class Witnesses {
 public:
  Witnesses(const SlopeFunction& f, const SearchNetwork& network, const SlopeSearchOptions& options,
            const std::vector<std::optional<Box>>& boxes)
      : f_(f), network_(network), options_(options) {
    for (std::size_t j = 0; j < boxes.size(); ++j) {
      const int inputs = (j == 0 ? f.moved : f.others[j - 1]).network->inputs();
      for (int k = 0; k < inputs; ++k) {
        intervals_.push_back(boxes[j] ? floats_within(boxes[j]->lower[k], boxes[j]->upper[k])
                                      : FloatInterval());
      }
    }
  }

  bool box_has_floats() const {
    return std::all_of(intervals_.begin(), intervals_.end(),
                       [](FloatInterval i) { return i.least <= i.greatest; });
  }

  /// Tries a pair of vectors (x, x_1, x_2, ...).
  void try_pair(const VectorXd& from, const VectorXd& to) {
    SlopePoints points;
    const int inputs = f_.moved.network->inputs();
    for (int k = 0; k < inputs; ++k) {
      points.x.push_back(rounded(k, from[k]));
      points.y.push_back(moves(k) ? rounded(k, to[k]) : points.x.back());
    }
    if (points.x == points.y) return;
    int next = inputs;
    for (const Term& other : f_.others) {
      points.others.emplace_back();
      for (int k = 0; k < other.network->inputs(); ++k, ++next) {
        points.others.back().push_back(rounded(next, (from[next] + to[next]) / 2));
      }
    }
    const double slope = estimate(points);
    pairs_.push_back(
        {std::isnan(slope) ? std::numeric_limits<double>::infinity() : slope, std::move(points)});
  }

  /// Tries an arbitrary pair of the box, so that there is a witness of slope 0 if nothing was found.
  void try_any_pair(const VectorXd& inputs) {
    for (int k = 0; k < f_.moved.network->inputs(); ++k) {
      if (!moves(k) || !(intervals_[k].least < intervals_[k].greatest)) continue;
      VectorXd from = inputs;
      VectorXd to = inputs;
      from[k] = std::max<double>(intervals_[k].least, -1);
      to[k] = std::min<double>(intervals_[k].greatest, 1);
      if (from[k] > to[k]) {  // the box does not intersect [-1, 1]
        from[k] = intervals_[k].least;
        to[k] = intervals_[k].greatest;
      }
      try_pair(from, to);
      if (!pairs_.empty()) return;
    }
  }

  /// Returns the steepest pair that was tried; empty points if there was none.
  SlopeWitness take() {
    std::stable_sort(pairs_.begin(), pairs_.end(),
                     [](const Pair& a, const Pair& b) { return a.estimate > b.estimate; });
    SlopeWitness best;
    for (Pair& pair : pairs_) {
      if (!best.x.empty() && pair.estimate * (1 + kSameSlope) < best.slope.value()) break;
      const LowerBound found = slope(f_, pair.points, options_.block);
      if (!best.x.empty() && found.value() <= best.slope.value()) continue;
      static_cast<SlopePoints&>(best) = std::move(pair.points);
      best.slope = found;
    }
    pairs_.clear();
    return best;
  }

 private:
  struct Pair {
    double estimate;  ///< slope in double
    SlopePoints points;
  };

  double estimate(const SlopePoints& points) const {
    std::vector<float> from = points.x, to = points.y;
    double run = 0;
    for (std::size_t k = 0; k < from.size(); ++k)
      run = std::hypot(run, static_cast<double>(from[k]) - static_cast<double>(to[k]));
    for (const std::vector<float>& other : points.others) {
      from.insert(from.end(), other.begin(), other.end());
      to.insert(to.end(), other.begin(), other.end());
    }
    return (network_.value(from) - network_.value(to)).norm() / run;
  }

  bool moves(int k) const {
    return options_.block.empty() || std::count(options_.block.begin(), options_.block.end(), k) > 0;
  }
  float rounded(int k, double value) const {
    // Clamped to the range of float32 before the conversion; rounded to nearest, then clamped to the box.
    const double inside = std::clamp<double>(value, intervals_[k].least, intervals_[k].greatest);
    return std::clamp(static_cast<float>(inside), intervals_[k].least, intervals_[k].greatest);
  }

  const SlopeFunction& f_;
  const SearchNetwork& network_;
  const SlopeSearchOptions& options_;
  std::vector<FloatInterval> intervals_;  ///< intervals of (x, x_1, x_2, ...)
  std::vector<Pair> pairs_;
};

/// Tries pairs around the centre z of a region along its steepest direction.
void try_region(const SearchNetwork& network, const VectorXd& z, Witnesses& witnesses) {
  const LinearRegion region = linear_region(network, z);
  if (!region.jacobian.allFinite()) return;
  const Eigen::JacobiSVD<MatrixXd> svd(region.jacobian, Eigen::ComputeThinV);
  const VectorXd steepest = svd.matrixV().col(0);
  VectorXd direction = VectorXd::Zero(network.variables());
  double length = 0;  // in the normalised coordinates
  for (Eigen::Index c = 0; c < steepest.size(); ++c) {
    const int v = network.block[static_cast<std::size_t>(c)];
    direction[v] = steepest[c] / network.scale[v];
    length = std::hypot(length, direction[v]);
  }
  if (!(length > 0 && std::isfinite(length))) return;
  direction /= length;
  Chord line = chord(network, region, z, direction);
  line.upper = std::min(line.upper, kLongestChord);
  line.lower = std::max(line.lower, -kLongestChord);
  const VectorXd middle = z + (line.lower + line.upper) / 2 * direction;
  const double half = (line.upper - line.lower) / 2;
  for (const double relative : kPairLengths) {
    const VectorXd step = relative * half * direction;
    witnesses.try_pair(network.inputs(middle - step), network.inputs(middle + step));
  }
}

/// Merges two lists of regions, steepest first.
std::vector<RegionWalk::Found> both(std::vector<RegionWalk::Found> regions,
                                    const std::vector<RegionWalk::Found>& more) {
  regions.insert(regions.end(), more.begin(), more.end());
  std::stable_sort(regions.begin(), regions.end(),
                   [](const auto& a, const auto& b) { return a.slope > b.slope; });
  return regions;
}

}  // namespace

SlopeWitness search_slope(const SlopeFunction& f, const SlopeSearchOptions& options) {
  keep_freed_memory();
  const Stop stop(options.cancelled, options.seconds);
  const std::vector<std::optional<Box>> boxes = check(f, options);
  const SearchNetwork network = search_network(f, boxes, options.block);
  Witnesses witnesses(f, network, options, boxes);
  if (!witnesses.box_has_floats()) return {};

  int rounds_done = 0;
  bool interrupted = false;
  if (!network.block.empty() && network.neurons() == 0) {
    try_region(network, VectorXd::Zero(network.variables()), witnesses);  // f is affine: a single region
  } else if (!network.block.empty()) {
    RegionWalk walk(network, options.seed, options.starts);
    RegionWalk far_out(network, options.seed + 1, {}, RegionWalk::Where::kFarOut);
    const bool is_open = std::count(network.boxed.begin(), network.boxed.end(), 0) == network.variables();
    std::vector<RegionWalk::Found> steepest;
    while (rounds_done < options.rounds) {
      interrupted =
          !walk.enter(kRegionsPerRound, stop) || (is_open && !far_out.enter(kFarRegionsPerRound, stop));
      if (!interrupted || rounds_done == 0) steepest = both(walk.steepest(), far_out.steepest());
      if (interrupted) break;
      ++rounds_done;
      if (options.progress) {
        options.progress(rounds_done, Estimate(steepest.empty() ? 0.0 : steepest.front().slope));
      }
    }
    for (const RegionWalk::Found& found : steepest) try_region(network, found.z, witnesses);
  }
  SlopeWitness result = witnesses.take();
  if (result.x.empty()) {
    witnesses.try_any_pair(network.inputs(VectorXd::Zero(network.variables())));
    result = witnesses.take();
  }
  result.rounds_done = rounds_done;
  result.interrupted = interrupted;
  return result;
}

}  // namespace swarmcert::lipschitz
