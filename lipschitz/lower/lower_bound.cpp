#include "lipschitz/lower/lower_bound.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "lipschitz/base/rounding.h"
#include "lipschitz/checker/witness.h"
#include "lipschitz/lower/slope_estimate.h"
#include "nn/weights/compositions.h"
#include "nn/weights/functions.h"

namespace swarmcert::lipschitz {
namespace {

using files::Network;
using files::Weights;

/// Largest number of neighbours in the search of a set function; more neighbours rarely increase the slope further.
constexpr int kMostNeighbours = 3;

/// Returns the fixed neighbours of a set function with `neighbours` neighbours in total: first those of the moving
/// neighbour's kind, then the other kinds in turn, each as often as the claim allows; and the ground.
std::vector<files::FunctionId> other_networks(const Network& network, const Claim& claim, int neighbours) {
  const std::vector<files::FunctionId> names = claim.function.parts();
  std::vector<files::FunctionId> others;
  if (names.size() == 1) return others;
  const files::FunctionId ground = files::FunctionId::ground_phi();
  const bool ground_moves = names[0] == ground;
  if (!ground_moves && files::parts(network).count(ground) == 1) others.push_back(ground);
  std::vector<files::FunctionId> kinds;
  if (!ground_moves) kinds.push_back(names[0]);
  for (const auto& [kind, weights] : network.phi) {
    const files::FunctionId name = files::FunctionId::phi(kind);
    if (name != ground && name != names[0]) kinds.push_back(name);
  }
  Neighbours left = claim.neighbours;
  if (!ground_moves && !left.empty()) --left[names[0].kind()];
  std::size_t turn = 0;
  for (int j = ground_moves ? 0 : 1; j < neighbours; ++j) {
    for (std::size_t tries = 0; tries < kinds.size(); ++tries, ++turn) {
      const files::FunctionId& name = kinds[turn % kinds.size()];
      if (!claim.neighbours.empty() && left[name.kind()]-- <= 0) continue;
      others.push_back(name);
      ++turn;
      break;
    }
  }
  return others;
}

/// Returns whether the claim's function is 0 for these neighbours and the moving one.
bool is_silent(const Network& network, const Claim& claim, std::vector<files::FunctionId> others) {
  others.push_back(claim.function.input_part());
  return files::is_silent_among(network, claim.function, others);
}

/// Returns the number of rounds for which a search takes seconds; a region costs about (weights) x (moving inputs).
int default_rounds(const Network& network, const files::FunctionId& function) {
  const files::Parts parts = files::parts(network);
  const std::vector<files::FunctionId> names = function.parts();
  double weights = 0;
  for (const files::FunctionId& name : names) {
    for (const files::Layer& layer : parts.at(name)->layers)
      weights += static_cast<double>(layer.weights.size());
  }
  constexpr double kPapersCost = 4.3e3 * 40;  // rho 40-40-40-40-1
  const double cost = weights * parts.at(names[0])->inputs();
  return static_cast<int>(
      std::clamp(kDefaultSearchRounds * kPapersCost / cost, 2.0, 1.0 * kDefaultSearchRounds));
}

/// The moved part of the function in coordinates x_k / scale_k, for the search in a weighted norm. Its weights are
/// rounded, because the search only proposes points.
struct Rescaled {
  Weights network;
  files::InputClamp clamp;
};

Rescaled rescaled(const Term& moved, const std::vector<double>& scale) {
  Rescaled result{*moved.network, {}};
  files::Layer& first = result.network.layers.front();
  for (std::size_t i = 0; i < first.weights.size(); ++i) first.weights[i] *= scale[i % scale.size()];
  if (moved.clamp == nullptr) return result;
  result.clamp = *moved.clamp;
  for (std::size_t k = 0; k < scale.size(); ++k) {
    result.clamp.lower[k] /= scale[k];
    result.clamp.upper[k] /= scale[k];
  }
  return result;
}

/// Runs search_slope() in the claim's norm; `box` and `f` are in the units of the inputs.
SlopeWitness search_scaled(const SlopeFunction& f, const Claim& claim, SlopeSearchOptions search) {
  const Rescaled moved = rescaled(f.moved, claim.scale);
  SlopeFunction scaled = f;
  scaled.moved = {&moved.network, f.moved.clamp == nullptr ? nullptr : &moved.clamp};
  const std::optional<Box> box = search.box;
  for (std::size_t k = 0; box && k < claim.scale.size(); ++k) {
    search.box->lower[k] /= claim.scale[k];
    search.box->upper[k] /= claim.scale[k];
  }
  for (Eigen::VectorXd& point : search.starts)
    for (Eigen::Index k = 0; k < point.size(); ++k) point(k) /= claim.scale[static_cast<std::size_t>(k)];
  SlopeWitness found = search_slope(scaled, search);
  const auto back = [&](std::vector<float>& x) {
    for (std::size_t k = 0; k < x.size(); ++k) {
      x[k] = static_cast<float>(static_cast<double>(x[k]) * claim.scale[k]);
      if (box && static_cast<double>(x[k]) < box->lower[k]) x[k] = std::nextafter(x[k], INFINITY);
      if (box && static_cast<double>(x[k]) > box->upper[k]) x[k] = std::nextafter(x[k], -INFINITY);
    }
  };
  back(found.x);
  back(found.y);
  if (found.x == found.y) return {};
  found.slope = slope(f, found, search.block, claim.scale);
  return found;
}

/// Rounds points to float32 points of a box; returns nothing for a box that contains none.
class FloatPoints {
 public:
  explicit FloatPoints(const Domain& domain) : domain_(domain) {}

  /// Returns the float32 point nearest to x in the box of `part`.
  std::optional<std::vector<float>> nearest(const files::FunctionId& part, const Eigen::VectorXd& x) const {
    constexpr double kMost = std::numeric_limits<float>::max();
    const auto box = domain_.find(part);
    std::vector<float> result;
    for (Eigen::Index k = 0; k < x.size(); ++k) {
      const auto i = static_cast<std::size_t>(k);
      const double low = box == domain_.end() ? -kMost : std::max(box->second.lower[i], -kMost),
                   high = box == domain_.end() ? kMost : std::min(box->second.upper[i], kMost);
      const std::optional<float> there = nearest_float(x[k], low, high);
      if (!there) return std::nullopt;
      result.push_back(*there);
    }
    return result;
  }

 private:
  const Domain& domain_;
};

/// Tries several pairs of points around a place and keeps the steepest. Short pairs are steeper if the function is
/// smooth; long pairs keep their direction when they are rounded to float32.
void try_pairs(const SlopeFunction& f, const files::FunctionId& moved, const SteepPlace& place,
               const Claim& claim, const std::vector<int>& block, const FloatPoints& points,
               SlopePoints& pair, FoundSlope& found) {
  constexpr double kLengths[] = {0.125, 1, 8, 64, 512, 8192};  // in units of half a step
  for (const double length : kLengths) {
    const Eigen::VectorXd step = length * place.half_step * place.direction;
    const auto x = points.nearest(moved, place.x + step), y = points.nearest(moved, place.x - step);
    if (!x || !y || *x == *y) continue;
    pair.x = *x;
    pair.y = *y;
    const LowerBound slope_of_pair = slope(f, pair, block, claim.scale);
    if (found.witness && found.witness->slope.value() >= slope_of_pair.value()) continue;
    found.witness.emplace();
    static_cast<SlopePoints&>(*found.witness) = pair;
    found.witness->slope = slope_of_pair;
  }
}

/// Returns the lower bound of a function that is not piecewise linear or not supported by search_slope().
FoundSlope sampled_lower_bound(const Network& network, const Claim& claim, const Domain& domain,
                               const LowerBoundOptions& options, int rounds) {
  const Domain boxes = claim.domain == "box" ? domain : Domain();
  SlopeEstimateOptions search;
  search.seed = options.seed;
  search.domain = boxes;
  search.starts = rounds;
  search.stop = Stop(options.cancelled, options.seconds);
  const SteepPlace place = steep_place(network, claim, search);
  FoundSlope found;
  found.rounds = place.starts;
  found.interrupted = place.interrupted;
  if (is_silent(network, claim, place.other_networks)) return found;
  const files::FunctionId moving = claim.function.input_part();
  const FloatPoints points(boxes);
  SlopePoints pair;
  for (std::size_t j = 0; j < place.others.size(); ++j) {
    std::optional<std::vector<float>> other = points.nearest(place.other_networks[j], place.others[j]);
    if (!other) return found;
    pair.others.push_back(std::move(*other));
  }
  found.other_networks = place.other_networks;
  try_pairs(slope_function(network, claim.function, place.other_networks), moving, place, claim,
            files::block_coordinates(network, claim.function, claim.block), points, pair, found);
  return found;
}

}  // namespace

bool has_relu_only(const Network& network, const files::FunctionId& function) {
  const std::vector<files::FunctionId> names = function.parts();
  const files::Parts parts = files::parts(network);
  return std::all_of(parts.begin(), parts.end(), [&names](const auto& part) {
    const bool enters = std::find(names.begin(), names.end(), part.first) != names.end() ||
                        (names.size() == 2 && part.first.is_phi());
    return part.second->is_relu() || !enters;
  });
}

FoundSlope lower_bound(const Network& network, const Claim& claim, const Domain& domain,
                       const LowerBoundOptions& options) {
  FoundSlope best;
  const int rounds = options.rounds.value_or(default_rounds(network, claim.function));
  if (rounds == 0) return best;
  if (!has_relu_only(network, claim.function))
    return sampled_lower_bound(network, claim, domain, options, rounds);
  const std::vector<files::FunctionId> names = claim.function.parts();
  const int cases = names.size() == 2 ? kMostNeighbours : 1;  // the cases share the rounds and the seconds
  for (int neighbours = 1; neighbours <= cases; ++neighbours) {
    const std::vector<files::FunctionId> others = other_networks(network, claim, neighbours);
    if (is_silent(network, claim, others)) continue;
    const SlopeFunction f = slope_function(network, claim.function, others);
    SlopeSearchOptions search;
    search.seed = options.seed + static_cast<std::uint64_t>(neighbours) * 1000003;
    search.rounds = (rounds + cases - 1) / cases;
    search.seconds = options.seconds / cases;
    search.cancelled = options.cancelled;
    search.starts = options.starts;
    if (claim.block != "all") search.block = files::block_coordinates(network, claim.function, claim.block);
    if (claim.domain == "box") {
      search.box = domain.at(names[0]);
      for (const files::FunctionId& name : others) search.other_boxes.emplace_back(domain.at(name));
    }
    SlopeWitness found = claim.scale.empty() ? search_slope(f, search) : search_scaled(f, claim, search);
    best.rounds += found.rounds_done;
    best.interrupted = best.interrupted || found.interrupted;
    if (found.x.empty()) continue;  // the box contains fewer than two points
    if (!best.witness || found.slope.value() > best.witness->slope.value()) {
      best.witness = std::move(found);
      best.other_networks = others;
    }
  }
  return best;
}

}  // namespace swarmcert::lipschitz
