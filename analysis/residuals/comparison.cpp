#include "analysis/residuals/comparison.h"

#include <fmt/core.h>

#include <algorithm>
#include <atomic>
#include <cctype>
#include <climits>
#include <cmath>

#include "analysis/residuals/track_part.h"
#include "nn/base/parallel.h"

namespace swarmcert::residuals {
namespace {

constexpr std::size_t kFewestOfRegion = 50;

/// Returns RegionErrors::share of `count` records with this bias; `all_squares_N2` is the total over all blocks.
double region_share(std::size_t count, double bias_N, double all_squares_N2) {
  return all_squares_N2 > 0 ? static_cast<double>(count) * bias_N * bias_N / all_squares_N2 : 0;
}

Eigen::Vector4d array_of(const Axes& a) { return {a.x, a.y, a.z, a.total}; }

Trajectories trajectories(const std::vector<TrackPart>& parts, bool has_gains) {
  Trajectories all;
  Eigen::Vector4d squares = Eigen::Vector4d::Zero(), max = squares, measured = squares, simulated = squares;
  std::vector<Eigen::Vector4d> ratios;
  std::string refused;
  for (const TrackPart& part : parts) {
    const TrajectoryErrors& track = part.errors.trajectory;
    if (!track.refused.empty()) {
      if (!part.errors.position_only) refused = track.refused;
      continue;
    }
    ++all.tracks;
    if (track.diverged) {
      ++all.diverged;
      continue;
    }
    all.seconds += track.seconds;
    squares += track.seconds * array_of(track.rmse).cwiseAbs2();
    measured += track.seconds * array_of(track.measured_rms).cwiseAbs2();
    simulated += track.seconds * array_of(track.simulated_rms).cwiseAbs2();
    max = max.cwiseMax(array_of(track.max));
    ratios.emplace_back(array_of(track.measured_max).cwiseQuotient(array_of(track.replayed_max)));
  }
  if (all.tracks == 0)
    all.refused = !has_gains ? "no gains were given" : refused.empty() ? "no vehicle has a model" : refused;
  if (all.seconds == 0) return all;
  const auto root = [&](const Eigen::Vector4d& sum) {
    const Eigen::Vector4d v = (sum / all.seconds).cwiseSqrt();
    return Axes{v[0], v[1], v[2], v[3]};
  };
  all.rmse_m = root(squares);
  all.measured_rms_m = root(measured);
  all.simulated_rms_m = root(simulated);
  all.max_m = {max[0], max[1], max[2], max[3]};
  const LearningError::Quantiles q = quantiles(ratios);
  Eigen::Vector4d covered = Eigen::Vector4d::Zero();
  for (const Eigen::Vector4d& ratio : ratios) covered += (ratio.array() <= 1).cast<double>().matrix();
  covered /= static_cast<double>(ratios.size());
  all.peak_ratio = {q.p50, q.p95, q.max, {covered[0], covered[1], covered[2], covered[3]}, ratios.size()};
  return all;
}

/// Residuals of the records in one region, with and without the model's effects.
struct Inside {
  std::vector<Eigen::Vector3f> r, r0;
  void add(const ResidualPoint& point) {
    r.push_back(point.r);
    r0.push_back(point.r0);
  }
};

/// The widest spread of squares that has at most kMost along x and along y.
PlaceSquares squares_of(const std::vector<TrackPart>& parts) {
  constexpr int kMost = 6;
  int low[2] = {INT_MAX, INT_MAX}, high[2] = {INT_MIN, INT_MIN};
  for (const TrackPart& part : parts) {
    for (const ResidualPoint& point : part.part.points) {
      for (int axis = 0; axis < 2 && point.place[0] != kNoPlace; ++axis) {
        low[axis] = std::min<int>(low[axis], point.place[axis]);
        high[axis] = std::max<int>(high[axis], point.place[axis]);
      }
    }
  }
  PlaceSquares squares;
  if (low[0] > high[0]) return squares;
  squares.width_m = kPlaceStep_m;
  while (std::max(high[0] - low[0], high[1] - low[1]) >= kMost) {
    squares.width_m *= 2;
    for (int* const index : {&low[0], &low[1], &high[0], &high[1]}) *index = *index >> 1;
  }
  for (int axis = 0; axis < 2; ++axis) {
    squares.first[axis] = low[axis];
    squares.count[axis] = high[axis] - low[axis] + 1;
  }
  return squares;
}

/// The square of a place, x fastest; -1 without a position.
int square_of(const ResidualPoint& point, const PlaceSquares& squares) {
  if (point.place[0] == kNoPlace) return -1;
  const double steps = squares.width_m / kPlaceStep_m;
  const auto along = [&](int axis) {
    return static_cast<int>(std::floor(point.place[axis] / steps)) - squares.first[axis];
  };
  return along(1) * squares.count[0] + along(0);
}

std::string name_of(const PlaceSquares& squares, int square) {
  const auto range = [&](int axis, int k) {
    const double from = squares.width_m * (squares.first[axis] + k);
    return fmt::format("{} {:g} .. {:g} m", "xy"[axis], from, from + squares.width_m);
  };
  return range(0, square % squares.count[0]) + ", " + range(1, square / squares.count[0]);
}

std::vector<RegionErrors> regions_of_all(const std::vector<TrackPart>& parts, const PlaceSquares& squares) {
  std::vector<RegionErrors> regions;
  double all_squares = 0;
  for (const TrackPart& part : parts) {
    for (const BlockSum& block : part.part.blocks) all_squares += block.squares.sum();
  }
  for (int variable = 0; variable <= kPlaceVariable; ++variable) {
    const bool is_place = variable == kPlaceVariable;
    std::vector<Inside> inside(
        static_cast<std::size_t>(is_place ? squares.count[0] * squares.count[1] : num_regions(variable)));
    for (const TrackPart& part : parts) {
      for (const ResidualPoint& point : part.part.points) {
        const int region = is_place ? square_of(point, squares) : point.regions[variable];
        if (region >= 0) inside[static_cast<std::size_t>(region)].add(point);
      }
    }
    for (std::size_t k = 0; k < inside.size(); ++k) {
      const auto& [r, r0] = inside[k];
      if (r.size() < kFewestOfRegion) continue;
      const int index = static_cast<int>(k);
      RegionErrors region = {variable, index,
                             is_place ? name_of(squares, index) : region_name(variable, index), 0,
                             statistics(r, r0)};
      region.share = region_share(r.size(), region.statistics.bias.total, all_squares);
      regions.push_back(std::move(region));
    }
  }
  // Sort by bias, i.e. by how far the model is consistently wrong in one direction. A region of few records with a
  // large bias comes before one of many records with a small bias.
  std::stable_sort(regions.begin(), regions.end(), [](const RegionErrors& a, const RegionErrors& b) {
    return a.statistics.bias.total > b.statistics.bias.total;
  });
  return regions;
}

/// Sets the composition of each track of a flight.
void name_compositions(const Kinds& kinds, std::vector<TrackPart>& tracks) {
  std::map<char, int> initials;
  for (const std::string& kind : kinds.names) ++initials[kind.empty() ? '?' : kind[0]];
  const bool brief =
      std::all_of(initials.begin(), initials.end(), [](const auto& entry) { return entry.second == 1; });
  const auto word = [brief](const std::string& kind) {
    return brief && !kind.empty() ? std::string(1, static_cast<char>(std::toupper(kind[0]))) : kind;
  };
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    std::vector<std::string> others;
    for (std::size_t j = 0; j < tracks.size(); ++j) {
      if (j != i) others.push_back(tracks[j].errors.kind);
    }
    std::sort(others.begin(), others.end(),
              [&](const std::string& a, const std::string& b) { return word(a) > word(b); });
    TrackErrors& errors = tracks[i].errors;
    std::string name;
    errors.composition_words = errors.kind + (others.empty() ? " alone" : " with ");
    for (const std::string& other : others) {
      errors.composition_words += (name.empty() ? "" : " and ") + other;
      name += (brief || name.empty() ? "" : "+") + word(other);
    }
    errors.composition = (name.empty() ? "Ge" : name) + "2" + word(errors.kind);
  }
}

}  // namespace

Leftover left_over(const Inputs& inputs, int jobs) {
  std::vector<std::vector<Part>> by_flight(inputs.found.flights.size());
  files::parallel_for(static_cast<int>(by_flight.size()), jobs, [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    std::vector<std::string> problems;
    for (Track& track : inputs.load(k, problems)) {
      if (!track.position_only) by_flight[k].push_back(residual_part(inputs, track));
    }
  });
  struct Sum {
    Eigen::Vector3d r = Eigen::Vector3d::Zero();
    std::size_t count = 0;
  };
  std::array<std::vector<Sum>, kNumVariables> regions;
  for (int v = 0; v < kNumVariables; ++v)
    regions[static_cast<std::size_t>(v)].resize(static_cast<std::size_t>(num_regions(v)));
  Spectrum spectrum;
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();
  double block_squares = 0, records = 0;
  for (const std::vector<Part>& parts : by_flight) {
    for (const Part& part : parts) {
      if (part.points.empty()) continue;
      spectrum.add(part.spectrum);
      for (const BlockSum& block : part.blocks) block_squares += block.squares.sum();
      records += static_cast<double>(part.points.size());
      for (const ResidualPoint& point : part.points) {
        const Eigen::Vector3d r = point.r.cast<double>();
        squares += r.cwiseAbs2();
        for (std::size_t v = 0; v < regions.size(); ++v) {
          if (point.regions[v] < 0) continue;
          Sum& sum = regions[v][static_cast<std::size_t>(point.regions[v])];
          sum.r += r;
          ++sum.count;
        }
      }
    }
  }
  Leftover left;
  left.rmse_N = records > 0 ? std::sqrt(squares.sum() / records) : 0;
  left.low_band_to_floor = spectrum.low_band_to_floor();
  left.noise_floor_N = spectrum.noise_floor_N();
  left.line = spectrum.line();
  for (std::size_t v = 0; v < regions.size(); ++v) {
    for (const Sum& sum : regions[v]) {
      if (sum.count < kFewestOfRegion) continue;
      left.region_shares[v] +=
          region_share(sum.count, (sum.r / static_cast<double>(sum.count)).norm(), block_squares);
    }
  }
  return left;
}

Comparison compare(const Inputs& inputs, int jobs, const Progress& progress, const GainsOfKinds& gains,
                   const std::function<void(std::size_t flight, const Track& track)>& visit) {
  const auto count = inputs.found.flights.size();
  std::vector<std::vector<TrackPart>> by_flight(count);
  std::vector<std::vector<std::string>> problems(count);
  std::atomic<int> done{0};
  files::parallel_for(static_cast<int>(count), jobs, [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    for (Track& track : inputs.load(k, problems[k])) {
      if (visit) visit(k, track);
      by_flight[k].push_back(track_part(inputs, gains, track));
    }
    name_compositions(inputs.kinds, by_flight[k]);
    progress(++done, static_cast<int>(count));
  });

  Comparison result;
  std::vector<TrackPart> parts;
  for (std::size_t k = 0; k < count; ++k) {
    for (TrackPart& part : by_flight[k]) parts.push_back(std::move(part));
    result.problems.insert(result.problems.end(), problems[k].begin(), problems[k].end());
  }
  std::vector<const Part*> all;
  std::map<std::string, std::vector<const Part*>> scenarios, vehicles, kinds, compositions;
  for (const TrackPart& part : parts) {
    if (part.part.points.empty()) continue;
    all.push_back(&part.part);
    result.judged = result.judged.cwiseProduct(part.errors.judged);
    scenarios[part.errors.scenario].push_back(&part.part);
    vehicles[part.errors.vehicle].push_back(&part.part);
    kinds[part.errors.kind].push_back(&part.part);
    compositions[part.errors.composition].push_back(&part.part);
    result.composition_words[part.errors.composition] = part.errors.composition_words;
    result.moments.insert(result.moments.end(), part.moments.begin(), part.moments.end());
  }
  result.overall = errors_of(all);
  for (const auto& [name, members] : scenarios) result.scenarios[name] = errors_of(members);
  for (const auto& [name, members] : vehicles) result.vehicles[name] = errors_of(members);
  for (const auto& [name, members] : kinds) result.kinds[name] = errors_of(members);
  for (const auto& [name, members] : compositions) result.compositions[name] = errors_of(members);
  result.squares = squares_of(parts);
  result.regions = regions_of_all(parts, result.squares);
  sort_and_shorten(result.moments);
  std::vector<Eigen::Vector4d> bias;
  std::vector<ErrorWindow> windows;
  for (const TrackPart& part : parts) {
    const Axes& mean = part.errors.errors.statistics.bias;
    if (!part.part.points.empty()) bias.push_back(with_norm({mean.x, mean.y, mean.z}));
    windows.insert(windows.end(), part.windows.begin(), part.windows.end());
  }
  result.learning_error = learning_error(bias, windows);
  result.trajectories = trajectories(parts, !gains.empty());
  for (const TrackPart& part : parts) {
    for (std::size_t i = 0; i < part.neighbours.cells.size(); ++i) {
      for (std::size_t j = 0; j < part.neighbours.cells[i].size(); ++j) {
        const NeighbourMap::Cell& cell = part.neighbours.cells[i][j];
        NeighbourMap::Cell& sum = result.neighbours.cells[i][j];
        sum.records += cell.records;
        sum.sum_N += cell.sum_N;
        sum.squares_N2 += cell.squares_N2;
      }
    }
  }
  for (TrackPart& part : parts) result.tracks.push_back(std::move(part.errors));
  return result;
}

}  // namespace swarmcert::residuals
