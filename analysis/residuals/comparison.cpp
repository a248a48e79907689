#include "analysis/residuals/comparison.h"

#include <fmt/core.h>

#include <algorithm>
#include <atomic>
#include <cctype>
#include <cmath>

#include "analysis/logs/read_log.h"
#include "analysis/residuals/force_residual.h"
#include "nn/files/parallel.h"

namespace swarmcert::residuals {
namespace {

constexpr double kBlock_s = 2;

struct Point {
  Eigen::Vector3f r, r0;
  RegionIndices regions;
};

/// Sums that groups of tracks share.
struct Part {
  std::vector<Point> points;
  std::vector<BlockSum> blocks;
  Spectrum spectrum;
  double weight_N = 0;
};

struct Window {
  Eigen::Vector4d amplitude, rate, variation, impulse;
};

struct TrackPart {
  TrackErrors errors;
  Part part;
  std::vector<Window> windows;
  std::vector<Moment> moments;
  NeighbourMap neighbours;
};

void add_to_map(const stability::Instant& now, double residual_z_N, NeighbourMap& map) {
  int row = -1, column = NeighbourMap::kLateral;
  double nearest_m = INFINITY;
  for (int j = 0; j < now.num_neighbours; ++j) {
    const Eigen::Vector3d& dp = now.neighbours[j].dp_W_m;
    const double lateral_m = dp.head<2>().norm();
    const double height = std::floor((dp.z() - NeighbourMap::kLowest_m) / NeighbourMap::kHeightStep_m);
    if (!(lateral_m < nearest_m) || !(height >= 0) || height >= NeighbourMap::kHeights) continue;
    nearest_m = lateral_m;
    row = static_cast<int>(height);
    column = static_cast<int>(std::min(lateral_m / NeighbourMap::kLateralStep_m, 1e6));
  }
  if (row < 0 || column >= NeighbourMap::kLateral) return;
  NeighbourMap::Cell& cell = map.cells[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)];
  ++cell.records;
  cell.sum_N += residual_z_N;
  cell.squares_N2 += residual_z_N * residual_z_N;
}

Eigen::Vector4d with_norm(const Eigen::Vector3d& v) {
  return {std::abs(v[0]), std::abs(v[1]), std::abs(v[2]), v.norm()};
}

/// Learning errors of the used records of one track. A window ends early at every gap or cut; short ones are dropped.
std::vector<Window> windows_of(const Track& track, const std::vector<Eigen::Vector3d>& r) {
  std::vector<Window> windows;
  Window window;
  double start_s = 0, last_s = 0;
  bool open = false;
  Eigen::Vector3d last = Eigen::Vector3d::Zero();
  AccelerometerFilter filter(LearningError::kBandwidth_hz, 1);
  const auto close = [&] {
    if (open && last_s - start_s > LearningError::kWindow_s / 2) windows.push_back(window);
    open = false;
  };
  for (std::size_t i = 0; i < r.size(); ++i) {
    const double time_s = track.instants[i].time_s;
    const bool breaks = track.restarts[i] != 0 || (i > 0 && track.cut[i - 1] != Cut::kNone);
    if (track.cut[i] != Cut::kNone) {
      close();
      continue;
    }
    if (breaks) {
      close();
      filter.restart();
    }
    Eigen::Matrix3Xd value = r[i];
    filter.advance(time_s, value);
    const Eigen::Vector3d now = value.col(0);
    if (open && time_s - start_s >= LearningError::kWindow_s) close();
    if (!open) {
      window = {with_norm(now), Eigen::Vector4d::Zero(), Eigen::Vector4d::Zero(), Eigen::Vector4d::Zero()};
      start_s = time_s;
      open = true;
    } else {
      const double step_s = time_s - last_s;
      const Eigen::Vector4d change = with_norm(now - last);
      window.amplitude = window.amplitude.cwiseMax(with_norm(now));
      window.rate = window.rate.cwiseMax(change / step_s);
      window.variation += change;
      window.impulse += step_s * with_norm(now);
    }
    last = now;
    last_s = time_s;
  }
  close();
  return windows;
}

/// The largest means over 0.1 s, at least 1 s apart.
std::vector<Moment> moments_of(const Track& track, const std::vector<Eigen::Vector3d>& r) {
  constexpr std::size_t kMean = 10;
  std::vector<Moment> found;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  std::size_t run = 0;
  for (std::size_t i = 0; i < r.size(); ++i) {
    if (track.cut[i] != Cut::kNone || track.restarts[i] != 0) {
      run = 0;
      sum.setZero();
      if (track.cut[i] != Cut::kNone) continue;
    }
    sum += r[i];
    if (++run > kMean) {
      sum -= r[i - kMean];
      run = kMean;
    }
    if (run < kMean) continue;
    const Moment moment = {track.flight, track.vehicle, track.path,
                           track.instants[i].time_s + track.clock_offset_s, sum / static_cast<double>(kMean)};
    if (!found.empty() && moment.time_s - found.back().time_s < 1) {
      if (moment.residual_N.norm() > found.back().residual_N.norm()) found.back() = moment;
    } else {
      found.push_back(moment);
    }
  }
  return found;
}

void sort_and_shorten(std::vector<Moment>& moments) {
  constexpr std::size_t kMoments = 8;
  std::stable_sort(moments.begin(), moments.end(), [](const Moment& a, const Moment& b) {
    return a.residual_N.squaredNorm() > b.residual_N.squaredNorm();
  });
  if (moments.size() > kMoments) moments.resize(kMoments);
}

void add_spectra(const Track& track, const std::vector<Eigen::Vector3d>& r, Spectrum& spectrum) {
  std::vector<Eigen::Vector3d> piece;
  double start_s = 0, end_s = 0;
  const auto flush = [&] {
    if (piece.size() > 1) spectrum.add(piece, (end_s - start_s) / static_cast<double>(piece.size() - 1));
    piece.clear();
  };
  for (std::size_t i = 0; i < r.size(); ++i) {
    if (track.restarts[i] != 0 || track.cut[i] != Cut::kNone) flush();
    if (track.cut[i] != Cut::kNone) continue;
    if (piece.empty()) start_s = track.instants[i].time_s;
    end_s = track.instants[i].time_s;
    piece.push_back(r[i]);
  }
  flush();
}

GroupErrors errors_of(const std::vector<const Part*>& parts) {
  GroupErrors group;
  std::vector<Eigen::Vector3f> r, r0;
  std::vector<BlockSum> blocks;
  Spectrum spectrum;
  double weight_sum = 0;
  for (const Part* part : parts) {
    for (const Point& point : part->points) {
      r.push_back(point.r);
      r0.push_back(point.r0);
    }
    blocks.insert(blocks.end(), part->blocks.begin(), part->blocks.end());
    spectrum.add(part->spectrum);
    weight_sum += part->weight_N * static_cast<double>(part->points.size());
  }
  group.statistics = statistics(r, r0);
  group.rmse_interval = bootstrap_rmse(blocks, 1);
  if (!r.empty()) {
    const double scale = static_cast<double>(r.size()) / weight_sum;
    const Axes& rmse = group.statistics.rmse;
    group.nrmse = {rmse.x * scale, rmse.y * scale, rmse.z * scale, rmse.total * scale};
  }
  group.low_band_to_floor = spectrum.low_band_to_floor();
  group.noise_floor_N = spectrum.noise_floor_N();
  return group;
}

const stability::Gains* gains_of(const GainsOfKinds& gains, const std::string& kind) {
  for (const std::string& name : {kind, std::string()}) {
    const auto found = gains.find(name);
    if (found != gains.end()) return &found->second;
  }
  return nullptr;
}

TrackPart track_part(const Inputs& inputs, const GainsOfKinds& gains, Track& track) {
  TrackPart result;
  TrackErrors& errors = result.errors;
  errors.flight = track.flight;
  errors.scenario = track.scenario;
  errors.vehicle = track.vehicle;
  errors.kind = track.kind;
  errors.path = track.path;
  errors.position_only = track.position_only;
  errors.clock_offset_s = track.clock_offset_s;
  errors.clock_onsets = track.clock_onsets;
  errors.findings = logs::findings(track.health);
  errors.is_sound = logs::is_sound(track.health);
  if (track.position_only) {
    errors.trajectory.refused = errors.torque.refused = "position only";
    return result;
  }

  const stability::Model& model = inputs.model_for(track);
  stability::Model nominal = model;
  nominal.effects.clear();
  apply_model(nominal, inputs.kinds, inputs.rules, track);
  const std::vector<Eigen::Vector3d> r0 = force_residual(nominal, inputs.kinds, inputs.rules, track);
  apply_model(model, inputs.kinds, inputs.rules, track);
  const std::vector<Eigen::Vector3d> r = force_residual(model, inputs.kinds, inputs.rules, track);

  Part& part = result.part;
  part.weight_N = model.weight_N();
  double block_end_s = -INFINITY;
  for (std::size_t i = 0; i < r.size(); ++i) {
    ++errors.cut[static_cast<std::size_t>(track.cut[i])];
    if (track.cut[i] != Cut::kNone) continue;
    const stability::Instant& now = track.instants[i];
    Point point{r[i].cast<float>(), r0[i].cast<float>(), {}};
    regions_of(now, now.time_s - track.instants.front().time_s, point.regions);
    part.points.push_back(point);
    if (now.time_s >= block_end_s) {
      part.blocks.emplace_back();
      block_end_s = now.time_s + kBlock_s;
    }
    part.blocks.back().squares += r[i].cwiseAbs2();
    part.blocks.back().count += 1;
    add_to_map(now, r[i].z(), result.neighbours);
    if (part.points.size() % 2 == 1) {
      errors.series.push_back({static_cast<float>(now.time_s + track.clock_offset_s), point.r.x(),
                               point.r.y(), point.r.z(), point.r0.z()});
    }
  }
  add_spectra(track, r, part.spectrum);
  result.windows = windows_of(track, r);
  result.moments = moments_of(track, r);
  sort_and_shorten(result.moments);
  errors.errors = errors_of({&part});
  errors.torque = torque_errors(model, track);
  const stability::Gains* const own_gains = gains_of(gains, track.kind);
  if (own_gains == nullptr) {
    errors.trajectory.refused = "no gains.toml for vehicles of kind " + track.kind;
  } else {
    const stability::Model flown = with_lag(model, *own_gains);
    apply_model(flown, inputs.kinds, inputs.rules, track);
    const std::vector<Eigen::Vector3d> left = force_residual(flown, inputs.kinds, inputs.rules, track);
    errors.trajectory = fly_along(flown, *own_gains, inputs.kinds, track, left);
  }
  return result;
}

Axes axes(const std::array<std::vector<double>, 4>& values, double p) {
  std::array<double, 4> q{};
  for (std::size_t k = 0; k < 4; ++k) {
    std::vector<double> copy = values[k];
    q[k] = p >= 1 && !copy.empty() ? *std::max_element(copy.begin(), copy.end()) : quantile(copy, p);
  }
  return {q[0], q[1], q[2], q[3]};
}

LearningError::Quantiles quantiles(const std::vector<Eigen::Vector4d>& values) {
  std::array<std::vector<double>, 4> columns;
  for (const Eigen::Vector4d& value : values) {
    for (std::size_t k = 0; k < 4; ++k) columns[k].push_back(value[static_cast<int>(k)]);
  }
  return {axes(columns, 0.5), axes(columns, 0.95), axes(columns, 0.99), axes(columns, 1)};
}

LearningError learning_error(const std::vector<TrackPart>& parts) {
  std::vector<Eigen::Vector4d> bias, amplitude, rate, variation, impulse;
  LearningError result;
  for (const TrackPart& part : parts) {
    const Axes& mean = part.errors.errors.statistics.bias;
    if (!part.part.points.empty()) bias.push_back(with_norm({mean.x, mean.y, mean.z}));
    for (const Window& window : part.windows) {
      amplitude.push_back(window.amplitude);
      rate.push_back(window.rate);
      variation.push_back(window.variation);
      impulse.push_back(window.impulse);
    }
    result.windows += part.windows.size();
  }
  result.bias_N = quantiles(bias);
  result.amplitude_N = quantiles(amplitude);
  result.rate_N_s = quantiles(rate);
  result.variation_N = quantiles(variation);
  result.impulse_N_s = quantiles(impulse);
  return result;
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

std::vector<RegionErrors> regions_of_all(const std::vector<TrackPart>& parts) {
  std::vector<RegionErrors> regions;
  double all_squares = 0;
  for (const TrackPart& part : parts) {
    for (const BlockSum& block : part.part.blocks) all_squares += block.squares.sum();
  }
  for (int variable = 0; variable < kNumVariables; ++variable) {
    const auto count = static_cast<std::size_t>(num_regions(variable));
    std::vector<std::vector<Eigen::Vector3f>> r(count), r0(count);
    for (const TrackPart& part : parts) {
      for (const Point& point : part.part.points) {
        if (point.regions[variable] < 0) continue;
        r[static_cast<std::size_t>(point.regions[variable])].push_back(point.r);
        r0[static_cast<std::size_t>(point.regions[variable])].push_back(point.r0);
      }
    }
    for (std::size_t k = 0; k < count; ++k) {
      constexpr std::size_t kFewest = 50;
      if (r[k].size() < kFewest) continue;
      RegionErrors region;
      region.variable = variable;
      region.region = static_cast<int>(k);
      region.statistics = statistics(r[k], r0[k]);
      const Axes& bias = region.statistics.bias;
      region.share =
          all_squares > 0 ? static_cast<double>(r[k].size()) * bias.total * bias.total / all_squares : 0;
      region.words = fmt::format("{}: {:+.2f} gf", region_name(variable, region.region),
                                 bias.z / stability::kGramForce_N);
      if (std::hypot(bias.x, bias.y) > std::abs(bias.z)) {
        region.words +=
            fmt::format(" up, {:.2f} gf sideways", std::hypot(bias.x, bias.y) / stability::kGramForce_N);
      }
      regions.push_back(std::move(region));
    }
  }
  // Worst: where the model is wrong by most, in the same direction every time. A region of few records with a large
  // bias comes before one of many records with a small one.
  std::stable_sort(regions.begin(), regions.end(), [](const RegionErrors& a, const RegionErrors& b) {
    return a.statistics.bias.total > b.statistics.bias.total;
  });
  return regions;
}

/// Sets the composition of every track of a flight.
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
      if (j != i) others.push_back(word(tracks[j].errors.kind));
    }
    std::sort(others.rbegin(), others.rend());
    std::string name;
    for (const std::string& other : others) name += (brief || name.empty() ? "" : "+") + other;
    tracks[i].errors.composition = (name.empty() ? "Ge" : name) + "2" + word(tracks[i].errors.kind);
  }
}

}  // namespace

Comparison compare(const Inputs& inputs, int jobs, const Progress& progress, const GainsOfKinds& gains) {
  const auto count = inputs.found.flights.size();
  std::vector<std::vector<TrackPart>> by_flight(count);
  std::vector<std::vector<std::string>> problems(count);
  std::atomic<int> done{0};
  files::parallel_for(static_cast<int>(count), jobs, [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    for (Track& track : inputs.load(k, problems[k])) by_flight[k].push_back(track_part(inputs, gains, track));
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
    scenarios[part.errors.scenario].push_back(&part.part);
    vehicles[part.errors.vehicle].push_back(&part.part);
    kinds[part.errors.kind].push_back(&part.part);
    compositions[part.errors.composition].push_back(&part.part);
    result.moments.insert(result.moments.end(), part.moments.begin(), part.moments.end());
  }
  result.overall = errors_of(all);
  for (const auto& [name, members] : scenarios) result.scenarios[name] = errors_of(members);
  for (const auto& [name, members] : vehicles) result.vehicles[name] = errors_of(members);
  for (const auto& [name, members] : kinds) result.kinds[name] = errors_of(members);
  for (const auto& [name, members] : compositions) result.compositions[name] = errors_of(members);
  result.regions = regions_of_all(parts);
  sort_and_shorten(result.moments);
  result.learning_error = learning_error(parts);
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
