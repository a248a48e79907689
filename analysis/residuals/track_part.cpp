#include "analysis/residuals/track_part.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "analysis/logs/read_log.h"
#include "analysis/residuals/force_residual.h"
#include "analysis/residuals/place_residual.h"

namespace swarmcert::residuals {
namespace {

constexpr double kBlock_s = 2;

void add_to_map(const stability::Instant& now, double residual_z_N, NeighbourMap& map) {
  const auto [row, column] = place_of(now);
  if (row < 0) return;
  NeighbourMap::Cell& cell = map.cells[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)];
  ++cell.records;
  cell.sum_N += residual_z_N;
  cell.squares_N2 += residual_z_N * residual_z_N;
}

/// Returns the largest means over 0.1 s, at least 1 s apart.
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

void add_spectra(const Track& track, const std::vector<Eigen::Vector3d>& r, Spectrum& spectrum) {
  std::vector<Eigen::Vector3d> piece;
  double start_s = 0, end_s = 0;
  std::function<double(double)> passes;
  if (track.force_source != logs::ForceSource::kAccelerometer)
    passes = [&](double hz) { return power_passed(track.force_source, track.window_s, hz); };
  const auto flush = [&] {
    if (piece.size() > 1)
      spectrum.add(piece, (end_s - start_s) / static_cast<double>(piece.size() - 1), passes);
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

const stability::Gains* gains_of(const GainsOfKinds& gains, const std::string& kind) {
  for (const std::string& name : {kind, std::string()}) {
    const auto found = gains.find(name);
    if (found != gains.end()) return &found->second;
  }
  return nullptr;
}

/// Distributes the residuals `r`, and `r0` without effects, over points, blocks, the neighbour map and the series.
void add_records(const Track& track, const std::vector<Eigen::Vector3d>& r,
                 const std::vector<Eigen::Vector3d>& r0, TrackPart& result) {
  TrackErrors& errors = result.errors;
  Part& part = result.part;
  double block_end_s = -INFINITY;
  for (std::size_t i = 0; i < r.size(); ++i) {
    ++errors.cut[static_cast<std::size_t>(track.cut[i])];
    if (track.cut[i] != Cut::kNone) continue;
    const stability::Instant& now = track.instants[i];
    if (i > 0 && track.cut[i - 1] == Cut::kNone && track.restarts[i] == 0)
      errors.used_s += now.time_s - track.instants[i - 1].time_s;
    if (track.judged.isZero()) continue;
    ResidualPoint point{r[i].cast<float>(), r0[i].cast<float>(), {}, {kNoPlace, kNoPlace}};
    constexpr double kFarthest = std::numeric_limits<std::int16_t>::max();
    for (int axis = 0; axis < 2 && track.has_height; ++axis)
      point.place[axis] = static_cast<std::int16_t>(
          std::clamp(std::floor(now.p_W_m[axis] / kPlaceStep_m), -kFarthest, kFarthest));
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
}

/// Returns the errors of a simulation along the track, with the gains of the log or else of the vehicle's kind.
TrajectoryErrors trajectory_errors(const Inputs& inputs, const GainsOfKinds& gains,
                                   const stability::Model& model, Track& track) {
  TrajectoryErrors errors;
  const auto of_log = inputs.log_gains.find(track.path);
  const stability::Gains* const own_gains =
      of_log != inputs.log_gains.end() ? &of_log->second : gains_of(gains, track.kind);
  if (track.thrust_source != logs::ThrustSource::kDuty) {
    errors.refused = "the log has no duty of each motor";
  } else if (!model.rotors.empty()) {
    errors.refused = "simulation needs four rotors in X";
  } else if (own_gains == nullptr) {
    errors.refused = "no gains.toml for vehicles of kind " + track.kind;
  } else {
    const stability::Model flown = with_lag(model, *own_gains);
    apply_model(flown, inputs.kinds, inputs.rules, track);
    const std::vector<Eigen::Vector3d> left = force_residual(flown, inputs.kinds, inputs.rules, track);
    errors = fly_along(flown, *own_gains, inputs.kinds, track, left);
  }
  return errors;
}

}  // namespace

void sort_and_shorten(std::vector<Moment>& moments) {
  constexpr std::size_t kMoments = 8;
  std::stable_sort(moments.begin(), moments.end(), [](const Moment& a, const Moment& b) {
    return a.residual_N.squaredNorm() > b.residual_N.squaredNorm();
  });
  if (moments.size() > kMoments) moments.resize(kMoments);
}

GroupErrors errors_of(const std::vector<const Part*>& parts) {
  GroupErrors group;
  std::vector<Eigen::Vector3f> r, r0;
  std::vector<BlockSum> blocks;
  Spectrum spectrum;
  double weight_sum = 0;
  for (const Part* part : parts) {
    for (const ResidualPoint& point : part->points) {
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

Part residual_part(const Inputs& inputs, Track& track) {
  const stability::Model model = inputs.model_for(track);
  apply_model(model, inputs.kinds, inputs.rules, track);
  const std::vector<Eigen::Vector3d> r = force_residual(model, inputs.kinds, inputs.rules, track);
  TrackPart result;
  add_records(track, r, r, result);
  add_spectra(track, r, result.part.spectrum);
  return std::move(result.part);
}

TrackPart track_part(const Inputs& inputs, const GainsOfKinds& gains, Track& track) {
  TrackPart result;
  TrackErrors& errors = result.errors;
  static_cast<TrackHead&>(errors) = track;
  errors.findings = logs::findings(track.health);
  errors.is_sound = logs::is_sound(track.health);
  if (track.position_only) {
    errors.trajectory.refused = errors.torque.refused = "position only";
    return result;
  }

  const stability::Model model = inputs.model_for(track);
  stability::Model nominal = model;
  nominal.effects.clear();
  apply_model(nominal, inputs.kinds, inputs.rules, track);
  const std::vector<Eigen::Vector3d> r0 = force_residual(nominal, inputs.kinds, inputs.rules, track);
  apply_model(model, inputs.kinds, inputs.rules, track);
  const std::vector<Eigen::Vector3d> r = force_residual(model, inputs.kinds, inputs.rules, track);

  result.part.weight_N = model.weight_N();
  add_records(track, r, r0, result);
  if (!track.judged.isZero()) {
    add_spectra(track, r, result.part.spectrum);
    result.windows = error_windows(track, r);
    result.moments = moments_of(track, r);
    sort_and_shorten(result.moments);
  }
  errors.errors = errors_of({&result.part});
  if (inputs.rules.per_mass)
    errors.torque.refused =
        "no model gives the rotor positions: name one ('swarmcert model draft' writes it)";
  else
    errors.torque = torque_errors(model, inputs.kinds, track);
  errors.trajectory = trajectory_errors(inputs, gains, model, track);
  return result;
}

}  // namespace swarmcert::residuals
