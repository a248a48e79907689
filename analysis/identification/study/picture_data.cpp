#include "analysis/identification/study/picture_data.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "analysis/identification/study/residual_under.h"

namespace swarmcert::identification {
namespace {

constexpr double kPictureBlock_s = 2;

/// Residuals of the uncut records of a track with several models.
struct Records {
  std::vector<Eigen::Vector2f> place_m;
  std::vector<int> block;
  std::vector<std::vector<Eigen::Vector3f>> residual_N;  ///< [model][record]
};

void add_track(const residuals::Track& track, const std::vector<stability::Model>& models,
               const residuals::Inputs& inputs, int& next_block, Records& all) {
  std::vector<std::vector<Eigen::Vector3d>> residual;
  for (const stability::Model& model : models) residual.push_back(residual_under(model, inputs, track));
  double block_start_s = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < track.instants.size(); ++i) {
    if (track.cut[i] != residuals::Cut::kNone) continue;
    const stability::Instant& now = track.instants[i];
    if (now.time_s - block_start_s >= kPictureBlock_s) {
      block_start_s = now.time_s;
      ++next_block;
    }
    all.place_m.emplace_back(now.p_W_m.head<2>().cast<float>());
    all.block.push_back(next_block);
    for (std::size_t m = 0; m < models.size(); ++m) all.residual_N[m].push_back(residual[m][i].cast<float>());
  }
}

Records collect(const residuals::Inputs& inputs, const std::vector<stability::Model>& models) {
  Records all;
  all.residual_N.resize(models.size());
  int next_block = -1;
  for (std::size_t flight = 0; flight < inputs.found.flights.size(); ++flight) {
    std::vector<std::string> problems;
    for (const residuals::Track& track : inputs.load(flight, problems))
      if (!track.position_only && track.kind == models[0].kind)
        add_track(track, models, inputs, next_block, all);
  }
  return all;
}

/// Returns the axis with the largest mean square.
int largest_axis(const std::vector<Eigen::Vector3f>& residual_N) {
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3f& r : residual_N) squares += r.cast<double>().cwiseAbs2();
  int axis = 2;
  squares.maxCoeff(&axis);
  return axis;
}

RoomMap room_map(const Records& records, std::size_t before, std::size_t after) {
  RoomMap map;
  if (records.place_m.empty()) return map;
  map.axis = largest_axis(records.residual_N[before]);
  Eigen::Vector2f lower = records.place_m[0], upper = lower;
  for (const Eigen::Vector2f& place : records.place_m) {
    lower = lower.cwiseMin(place);
    upper = upper.cwiseMax(place);
  }
  for (int axis = 0; axis < 2; ++axis) {
    map.lower_m[axis] = static_cast<double>(lower[axis]);
    map.step_m[axis] = std::max(1e-3, static_cast<double>(upper[axis] - lower[axis]) / RoomMap::kCells);
  }
  map.cells.resize(RoomMap::kCells * RoomMap::kCells);
  for (std::size_t i = 0; i < records.place_m.size(); ++i) {
    const auto index = [&](int axis) {
      const double offset_m = static_cast<double>(records.place_m[i][axis]) - map.lower_m[axis];
      return std::clamp(static_cast<int>(offset_m / map.step_m[axis]), 0, RoomMap::kCells - 1);
    };
    RoomMap::Cell& cell = map.cells[static_cast<std::size_t>(index(1) * RoomMap::kCells + index(0))];
    ++cell.records;
    cell.before_N += static_cast<double>(records.residual_N[before][i][map.axis]);
    cell.after_N += static_cast<double>(records.residual_N[after][i][map.axis]);
  }
  for (RoomMap::Cell& cell : map.cells) {
    if (cell.records == 0) continue;
    cell.before_N /= static_cast<double>(cell.records);
    cell.after_N /= static_cast<double>(cell.records);
  }
  return map;
}

/// Returns one bin of an effect's curve. The error is that of the mean over blocks, as records within a block are
/// correlated.
EffectCurve::Point point_of(const std::vector<std::size_t>& bin, const std::vector<double>& predicted_N,
                            const std::vector<double>& measured_N, const std::vector<int>& block) {
  EffectCurve::Point point;
  std::map<int, std::pair<double, double>> blocks;  // sum, count
  for (const std::size_t i : bin) {
    point.predicted_N += predicted_N[i];
    point.measured_N += measured_N[i];
    blocks[block[i]].first += measured_N[i];
    blocks[block[i]].second += 1;
  }
  const auto count = static_cast<double>(bin.size());
  point.records = bin.size();
  point.predicted_N /= count;
  point.measured_N /= count;
  double squares = 0;
  for (const auto& [number, sum] : blocks) {
    const double deviation = sum.first - sum.second * point.measured_N;
    squares += deviation * deviation;
  }
  point.error_N = std::sqrt(squares) / count;
  return point;
}

EffectCurve effect_curve(const Records& records, const std::string& effect, std::size_t with,
                         std::size_t without) {
  constexpr std::size_t kBins = 12, kFewest = 20;
  const std::size_t count = records.block.size();
  EffectCurve curve;
  curve.effect = effect;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero(), squares = mean;
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3d force =
        (records.residual_N[without][i] - records.residual_N[with][i]).cast<double>();
    mean += force;
    squares += force.cwiseAbs2();
  }
  if (count == 0) return curve;
  mean /= static_cast<double>(count);
  int axis = 2;
  (squares / static_cast<double>(count) - mean.cwiseAbs2()).maxCoeff(&axis);
  curve.axis = "xyz"[axis];
  std::vector<double> predicted_N(count), measured_N(count);
  for (std::size_t i = 0; i < count; ++i) {
    measured_N[i] = static_cast<double>(records.residual_N[without][i][axis]);
    predicted_N[i] = measured_N[i] - static_cast<double>(records.residual_N[with][i][axis]);
  }
  const auto [least, most] = std::minmax_element(predicted_N.begin(), predicted_N.end());
  if (!(*most > *least)) return curve;  // an effect that is constant has no curve
  std::vector<std::vector<std::size_t>> bins(kBins);
  for (std::size_t i = 0; i < count; ++i) {
    const double place = (predicted_N[i] - *least) / (*most - *least);
    bins[std::min(kBins - 1, static_cast<std::size_t>(place * kBins))].push_back(i);
  }
  for (const std::vector<std::size_t>& bin : bins)
    if (bin.size() >= kFewest) curve.points.push_back(point_of(bin, predicted_N, measured_N, records.block));
  return curve;
}

}  // namespace

PictureData picture_data(const residuals::Inputs& inputs, const stability::Model& before,
                         const stability::Model& after) {
  std::vector<stability::Model> models = {before, after};
  std::vector<std::string> names;
  for (std::size_t k = 0; k < after.effects.size(); ++k) {
    stability::Model without = after;
    without.effects.erase(without.effects.begin() + static_cast<std::ptrdiff_t>(k));
    models.push_back(without);
    const stability::EffectSpec& effect = after.effects[k];
    names.push_back(effect.name + (effect.vehicle.empty() ? "" : " of " + effect.vehicle));
  }
  const Records records = collect(inputs, models);
  PictureData data;
  data.room = room_map(records, 0, 1);
  for (std::size_t k = 0; k < names.size(); ++k) {
    EffectCurve curve = effect_curve(records, names[k], 1, 2 + k);
    if (curve.points.size() >= 3) data.effects.push_back(std::move(curve));
  }
  return data;
}

}  // namespace swarmcert::identification
