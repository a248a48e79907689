#include "lipschitz/slope_map.h"

#include <algorithm>
#include <mutex>
#include <optional>
#include <stdexcept>

#include "lipschitz/certify_bounds.h"
#include "lipschitz/values/range.h"
#include "nn/base/parallel.h"
#include "nn/base/suggest.h"
#include "nn/weights/functions.h"

namespace swarmcert::lipschitz {
namespace {

/// Relative distance to an attained slope at which branch and bound stops, and relative gap (of the squared bound) at
/// which the search for multipliers stops.
constexpr double kTolerance = 0.01;
/// Linear regions entered per round of the lower-bound search.
constexpr int kRegions = 15;

bool has_map(const files::Network& network, const CertifiedBound& bound) {
  if (bound.block != "all" || !bound.scale.empty() || !bound.neighbours.empty()) return false;
  const std::vector<files::FunctionId> mapped = value_functions(network);
  return std::find(mapped.begin(), mapped.end(), bound.function) != mapped.end();
}

int moving_inputs(const files::Network& network) {
  for (const auto& [name, weights] : files::parts(network)) {
    if (files::is_clamped(name)) return weights->inputs();
  }
  throw std::invalid_argument("slope map: the network has no part whose input moves");
}

/// Returns boundary i, 0 <= i <= n, of n equal intervals; the outer boundaries are exactly those of the box.
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

/// Appends the points of a witness in the form of LowerBoundOptions::places.
void add_place(const FoundSlope& found, std::vector<Eigen::VectorXd>& places) {
  if (!found.witness) return;
  std::vector<float> all = found.witness->x;
  for (const std::vector<float>& other : found.witness->others)
    all.insert(all.end(), other.begin(), other.end());
  places.push_back(
      Eigen::Map<const Eigen::VectorXf>(all.data(), static_cast<Eigen::Index>(all.size())).cast<double>());
}

/// Computes the cells of one function. Data that the cells share are computed once.
class Cells {
 public:
  Cells(const files::Network& network, const Certification& found, const CertifiedBound& everywhere,
        const SlopeMapOptions& options)
      : network_(network),
        options_(options),
        layers_(found.layers),
        everywhere_(everywhere),
        claim_(everywhere) {
    claim_.domain = "box";
    if (everywhere.is_relu) bounds_.emplace(network, everywhere, multipliers(everywhere));
  }

  /// Bounds the slope in a cell.
  /// @param before the adjacent cell or null; points where it is steep are starting points for this cell.
  void look_at(SlopeCell& cell, const SlopeCell* before) const {
    if (options_.cancelled != nullptr && *options_.cancelled) return;
    LowerBoundOptions lower;
    lower.seed = options_.seed;
    lower.rounds = options_.rounds;
    lower.regions = kRegions;
    lower.cancelled = options_.cancelled;
    lower.moved = cell.box;
    add_place(everywhere_.lower, lower.places);
    if (before != nullptr) add_place(before->lower, lower.places);
    cell.lower = lower_bound(network_, claim_, options_.domain, lower);
    const files::FunctionId moving = claim_.function.input_part();
    const Box box = clamped(network_, {{moving, cell.box}}).at(moving);
    if (bounds_) {
      branch(box, cell);
    } else {
      bound_by_slopes(box, cell);
    }
  }

 private:
  void branch(const Box& box, SlopeCell& cell) const {
    BranchOptions branch;
    branch.nodes = options_.nodes;
    branch.boxes_only = true;
    branch.known = cell.lower.witness ? cell.lower.witness->slope.value() : 0;
    branch.tolerance = kTolerance;
    branch.cancelled = options_.cancelled;
    const LocalBound local = bounds_->on(box, branch);
    if (!local.proof || !(local.upper.value() < cell.upper.value())) return;
    cell.upper = local.upper;
    cell.is_local = true;
  }

  void bound_by_slopes(const Box& box, SlopeCell& cell) const {
    CertifiedBound bound;
    static_cast<Claim&>(bound) = claim_;
    bound.has_slopes = everywhere_.has_slopes;
    bound.upper = cell.upper;
    bound_by_slopes_on_box(network_, box, layers_, UpperMethod::kAuto,
                           {Stop(options_.cancelled), {}, kTolerance}, bound);
    if (!(bound.upper.value() < cell.upper.value())) return;
    cell.upper = bound.upper;
    cell.method = bound.method;
    cell.is_local = true;
  }

  static std::vector<double> multipliers(const CertifiedBound& bound) {
    if (bound.proof) return bound.proof->t;
    return bound.sdp.proof ? bound.sdp.proof->t : std::vector<double>();
  }

  const files::Network& network_;
  const SlopeMapOptions& options_;
  const std::vector<CertifiedLayer>& layers_;
  const CertifiedBound& everywhere_;
  Claim claim_;
  std::optional<LocalBounds> bounds_;  ///< for ReLU networks only
};

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
  std::vector<Cells> functions;
  for (const CertifiedBound& bound : found.bounds) {
    if (!has_map(network, bound)) continue;
    functions.emplace_back(network, found, bound, options);
    maps.push_back({bound.function, {}});
    const Box& box = options.domain.at(bound.function.input_part());
    for (int i = 0; i < options.cells[0] * options.cells[1]; ++i)
      maps.back().cells.push_back({cell_box(box, options, i), bound.upper, false, UpperMethod::kBranch, {}});
  }
  // The cells of a row are processed in order, rows in parallel.
  const int rows = options.cells[0], columns = options.cells[1];
  const int total = rows * columns * static_cast<int>(maps.size());
  int done = 0;
  std::mutex mutex;
  files::parallel_for(rows * static_cast<int>(maps.size()), options.jobs, [&](int i) {
    const auto m = static_cast<std::size_t>(i / rows);
    SlopeCell* const row = &maps[m].cells[static_cast<std::size_t>(i % rows * columns)];
    for (int j = 0; j < columns; ++j) {
      functions[m].look_at(row[j], j > 0 ? &row[j - 1] : nullptr);
      const std::lock_guard<std::mutex> lock(mutex);
      if (options.progress) options.progress(++done, total);
    }
  });
  return maps;
}

}  // namespace swarmcert::lipschitz
