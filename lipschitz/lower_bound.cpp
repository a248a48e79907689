#include "lipschitz/lower_bound.h"

#include <algorithm>
#include <cmath>

#include "lipschitz/checker/witness.h"
#include "nn/weights/functions.h"

namespace swarmcert::lipschitz {
namespace {

using files::Network;
using files::Weights;

/// Numbers of neighbours at which a set function is searched: more rarely steepen it further.
constexpr int kMostNeighbours = 3;

/// The fixed neighbours of a set function with `neighbours` neighbours in all: the moving one's own kind first, then
/// the other kinds in turn, each as often as the claim allows; and the ground.
std::vector<std::string> other_networks(const Network& network, const Claim& claim, int neighbours) {
  const std::vector<std::string> names = files::networks_of(claim.function);
  std::vector<std::string> others;
  if (names.size() == 1) return others;
  const std::string ground = files::kGroundPhi;
  const bool ground_moves = names[0] == ground;
  if (!ground_moves && files::parts(network).count(ground) == 1) others.push_back(ground);
  std::vector<std::string> kinds;
  if (!ground_moves) kinds.push_back(names[0]);
  for (const auto& [kind, weights] : network.phi) {
    const std::string name = files::phi_name(kind);
    if (name != ground && name != names[0]) kinds.push_back(name);
  }
  Neighbours left = claim.neighbours;
  if (!ground_moves && !left.empty()) --left[files::kind_of(names[0])];
  std::size_t turn = 0;
  for (int j = ground_moves ? 0 : 1; j < neighbours; ++j) {
    for (std::size_t tries = 0; tries < kinds.size(); ++tries, ++turn) {
      const std::string& name = kinds[turn % kinds.size()];
      if (!claim.neighbours.empty() && left[files::kind_of(name)]-- <= 0) continue;
      others.push_back(name);
      ++turn;
      break;
    }
  }
  return others;
}

/// Rounds that keep the search of a function to seconds: a region costs about (weights) x (moving inputs).
int default_rounds(const Network& network, const std::string& function) {
  const std::map<std::string, const Weights*> parts = files::parts(network);
  const std::vector<std::string> names = files::networks_of(function);
  double weights = 0;
  for (const std::string& name : names) {
    for (const files::Layer& layer : parts.at(name)->layers)
      weights += static_cast<double>(layer.weights.size());
  }
  constexpr double kPapersCost = 4.3e3 * 40;  // rho 40-40-40-40-1
  const double cost = weights * parts.at(names[0])->inputs();
  return static_cast<int>(
      std::clamp(kDefaultSearchRounds * kPapersCost / cost, 2.0, 1.0 * kDefaultSearchRounds));
}

/// The moved part of the function in coordinates x_k / scale_k, as the search of a weighted norm sees it. Rounded: a
/// search only proposes points.
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

/// search_slope() in the claim's norm; `box` and `f` in the units of the inputs.
SlopeWitness search_scaled(const SlopeFunction& f, const Claim& claim, SlopeSearchOptions search) {
  const Rescaled moved = rescaled(f.moved, claim.scale);
  SlopeFunction scaled = f;
  scaled.moved = {&moved.network, f.moved.clamp == nullptr ? nullptr : &moved.clamp};
  const std::optional<Box> box = search.box;
  for (std::size_t k = 0; box && k < claim.scale.size(); ++k) {
    search.box->lower[k] /= claim.scale[k];
    search.box->upper[k] /= claim.scale[k];
  }
  for (Eigen::VectorXd& start : search.starts)
    for (Eigen::Index k = 0; k < start.size(); ++k) start(k) /= claim.scale[static_cast<std::size_t>(k)];
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

}  // namespace

FoundSlope lower_bound(const Network& network, const Claim& claim, const std::map<std::string, Box>& domain,
                       const LowerBoundOptions& options) {
  FoundSlope best;
  const int rounds = options.rounds.value_or(default_rounds(network, claim.function));
  if (rounds == 0) return best;
  const std::vector<std::string> names = files::networks_of(claim.function);
  const int cases = names.size() == 2 ? kMostNeighbours : 1;  // they share the rounds and the seconds
  for (int neighbours = 1; neighbours <= cases; ++neighbours) {
    const std::vector<std::string> others = other_networks(network, claim, neighbours);
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
      for (const std::string& name : others) search.other_boxes.emplace_back(domain.at(name));
    }
    SlopeWitness found = claim.scale.empty() ? search_slope(f, search) : search_scaled(f, claim, search);
    best.rounds += found.rounds_done;
    best.interrupted = best.interrupted || found.interrupted;
    if (found.x.empty()) continue;  // the box holds no two points
    if (!best.witness || found.slope.value() > best.witness->slope.value()) {
      best.witness = std::move(found);
      best.other_networks = others;
    }
  }
  return best;
}

}  // namespace swarmcert::lipschitz
