#include "lipschitz/slope_map.h"

#include <algorithm>
#include <mutex>
#include <stdexcept>

#include "lipschitz/range.h"
#include "nn/base/parallel.h"
#include "nn/base/suggest.h"
#include "nn/weights/functions.h"

namespace swarmcert::lipschitz {
namespace {

/// Branch and bound need not come closer than this to a slope that is attained, relatively.
constexpr double kTolerance = 0.01;

bool has_map(const CertifiedBound& bound) {
  if (bound.block != "all" || !bound.scale.empty() || !bound.neighbours.empty()) return false;
  return bound.function == "network" ||
         (files::is_set(bound.function) && files::networks_of(bound.function).front() != files::kGroundPhi);
}

int moving_inputs(const files::Network& network) {
  for (const auto& [name, weights] : files::parts(network)) {
    if (files::is_clamped(name)) return weights->inputs();
  }
  throw std::invalid_argument("slope map: the network has no part whose input moves");
}

/// The end of the i-th of n intervals; the outer ends are exactly those of the box.
double edge(const Box& box, std::size_t k, int i, int n) {
  if (i == 0) return box.lower[k];
  if (i == n) return box.upper[k];
  return box.lower[k] + (box.upper[k] - box.lower[k]) * i / n;
}

Box cell_box(Box box, const SlopeMapOptions& options, int index) {
  const Box whole = box;
  const std::array<int, 2> at = {index / options.cells[1], index % options.cells[1]};
  for (std::size_t d = 0; d < 2; ++d) {
    const auto k = static_cast<std::size_t>(options.coordinates[d]);
    box.lower[k] = edge(whole, k, at[d], options.cells[d]);
    box.upper[k] = edge(whole, k, at[d] + 1, options.cells[d]);
  }
  return box;
}

void look_at(const files::Network& network, const CertifiedBound& everywhere, const SlopeMapOptions& options,
             SlopeCell& cell) {
  if (options.cancelled != nullptr && *options.cancelled) return;
  Claim claim = everywhere;
  claim.domain = "box";
  const std::string moving = files::networks_of(claim.function).front();
  std::map<std::string, Box> domain = options.domain;
  domain[moving] = cell.box;
  LowerBoundOptions lower;
  lower.seed = options.seed;
  lower.rounds = options.rounds;
  lower.cancelled = options.cancelled;
  cell.lower = lower_bound(network, claim, domain, lower);
  BranchOptions branch;
  branch.nodes = options.nodes;
  branch.known = cell.lower.witness ? cell.lower.witness->slope.value() : 0;
  branch.tolerance = kTolerance;
  branch.cancelled = options.cancelled;
  const UpperProof* const global = everywhere.proof       ? &*everywhere.proof
                                   : everywhere.sdp.proof ? &*everywhere.sdp.proof
                                                          : nullptr;
  const LocalBound local = local_bound(network, claim, clamped(network, domain),
                                       global != nullptr ? global->t : std::vector<double>(), branch);
  if (!local.proof || !(local.upper.value() < cell.upper.value())) return;
  cell.upper = local.upper;
  cell.is_local = true;
}

}  // namespace

std::string coordinate_name(const files::Network& network, int coordinate) {
  const auto k = static_cast<std::size_t>(coordinate);
  return k < network.input_order.size() ? network.input_order[k] : "x" + std::to_string(coordinate);
}

int map_coordinate(const files::Network& network, const std::string& name) {
  std::vector<std::string> names;
  for (int k = 0; k < moving_inputs(network); ++k) {
    names.push_back(coordinate_name(network, k));
    if (name == names.back() || name == "x" + std::to_string(k)) return k;
  }
  throw std::invalid_argument("the network has no input " + name + ": " + files::did_you_mean(name, names));
}

std::vector<SlopeMap> slope_maps(const files::Network& network, const Certification& found,
                                 const SlopeMapOptions& options) {
  const int inputs = moving_inputs(network);
  for (std::size_t d = 0; d < 2; ++d) {
    if (options.coordinates[d] < 0 || options.coordinates[d] >= inputs || options.cells[d] < 1)
      throw std::invalid_argument("slope map: no such coordinate, or no cell");
  }
  if (options.coordinates[0] == options.coordinates[1])
    throw std::invalid_argument("slope map: two different coordinates are needed");
  std::vector<SlopeMap> maps;
  std::vector<const CertifiedBound*> bounds;
  for (const CertifiedBound& bound : found.bounds) {
    if (!has_map(bound)) continue;
    bounds.push_back(&bound);
    maps.push_back({bound.function, {}});
    const Box& box = options.domain.at(files::networks_of(bound.function).front());
    for (int i = 0; i < options.cells[0] * options.cells[1]; ++i)
      maps.back().cells.push_back({cell_box(box, options, i), bound.upper, false, {}});
  }
  const int per_map = options.cells[0] * options.cells[1];
  const int total = per_map * static_cast<int>(maps.size());
  int done = 0;
  std::mutex mutex;
  files::parallel_for(total, options.jobs, [&](int i) {
    const auto m = static_cast<std::size_t>(i / per_map);
    look_at(network, *bounds[m], options, maps[m].cells[static_cast<std::size_t>(i % per_map)]);
    const std::lock_guard<std::mutex> lock(mutex);
    if (options.progress) options.progress(++done, total);
  });
  return maps;
}

}  // namespace swarmcert::lipschitz
