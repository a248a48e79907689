#include "analysis/identification/study/picture_data.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>
#include <utility>

#include "analysis/identification/scan/samples.h"
#include "analysis/residuals/residual_under.h"
#include "stability/effects/registry.h"

namespace swarmcert::identification {
namespace {

constexpr double kPictureBlock_s = 2;

/// Variables over which effects may be drawn: those of the scan that an instant tells, and three more.
constexpr std::size_t kScanned = static_cast<std::size_t>(kNumScanVariables);
constexpr std::size_t kThrustRate = kScanned, kBesideUpper = kScanned + 1, kFromMiddle = kScanned + 2,
                      kDrawable = kScanned + 3;
using Drawable = std::array<float, kDrawable>;

std::pair<std::string, std::string> name_and_unit(std::size_t variable) {
  if (variable == kThrustRate) return {"thrust rate", "N/s"};
  if (variable == kBesideUpper) return {"lateral distance to a vehicle above", "m"};
  if (variable == kFromMiddle) return {"distance from its middle", "m"};
  const ScanVariableInfo& info = scan_variable(static_cast<ScanVariable>(variable));
  std::string unit = info.unit;
  std::replace(unit.begin(), unit.end(), '_', '/');
  return {info.name, unit};
}

/// Returns the horizontal distance to the nearest vehicle that flies higher; NaN if none does.
double beside_upper_m(const stability::Instant& now) {
  double least_m = std::numeric_limits<double>::quiet_NaN();
  for (int j = 0; j < now.num_neighbours; ++j) {
    const Eigen::Vector3d& dp_m = now.neighbours[j].dp_W_m;
    if (dp_m.z() > 0 && !(dp_m.head<2>().norm() >= least_m)) least_m = dp_m.head<2>().norm();
  }
  return least_m;
}

Drawable drawable_of(const residuals::Track& track, std::size_t i) {
  const stability::Instant& now = track.instants[i];
  const ScanValues values = scan_values(now);
  Drawable all;
  std::transform(values.begin(), values.end(), all.begin(), [](double x) { return static_cast<float>(x); });
  all[kThrustRate] = std::numeric_limits<float>::quiet_NaN();
  constexpr double kRate_s = 0.05;
  std::size_t past = i;
  while (past > 0 && track.restarts[past] == 0 && now.time_s - track.instants[past].time_s < kRate_s) --past;
  const stability::Instant& then = track.instants[past];
  if (now.time_s - then.time_s >= kRate_s)
    all[kThrustRate] = static_cast<float>((now.thrust_N - then.thrust_N) / (now.time_s - then.time_s));
  all[kBesideUpper] = static_cast<float>(beside_upper_m(now));
  all[kFromMiddle] = std::numeric_limits<float>::quiet_NaN();
  return all;
}

/// Residuals of the uncut records of a track with several models.
struct Records {
  std::vector<Drawable> variables;
  std::vector<Eigen::Vector2f> place_m;
  std::vector<int> block;
  std::vector<std::vector<Eigen::Vector3f>> residual_N;  ///< [model][record]
};

void add_track(const residuals::Track& track, const std::vector<stability::Model>& models,
               const residuals::Inputs& inputs, int& next_block, Records& all) {
  std::vector<std::vector<Eigen::Vector3d>> residual;
  for (const stability::Model& model : models)
    residual.push_back(residuals::residual_under(model, inputs, track));
  double block_start_s = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < track.instants.size(); ++i) {
    if (track.cut[i] != residuals::Cut::kNone) continue;
    const stability::Instant& now = track.instants[i];
    if (now.time_s - block_start_s >= kPictureBlock_s) {
      block_start_s = now.time_s;
      ++next_block;
    }
    all.place_m.emplace_back(now.p_W_m.head<2>().cast<float>());
    all.variables.push_back(drawable_of(track, i));
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

/// The middle 99 % of the values of a variable, in steps.
struct VariableSteps {
  static constexpr int kCount = 100;
  double lower = 0, width = 0;

  /// -1: unknown or outside.
  int of(float value) const {
    const double place = (static_cast<double>(value) - lower) / width;
    return place >= 0 && place <= kCount ? std::min(kCount - 1, static_cast<int>(place)) : -1;
  }
};

VariableSteps steps_over(const Records& records, std::size_t variable) {
  std::vector<float> values;
  for (const Drawable& all : records.variables)
    if (std::isfinite(all[variable])) values.push_back(all[variable]);
  if (values.size() < records.variables.size() / 20 + 1) return {};
  const auto quantile = [&values](double share) {
    const auto at =
        values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), at, values.end());
    return static_cast<double>(*at);
  };
  const double lower = quantile(0.005), upper = quantile(0.995);
  return {lower, (upper - lower) / VariableSteps::kCount};
}

/// Sum and number of the values within a step.
struct StepSum {
  double sum = 0, count = 0;
  double mean() const { return sum / count; }
};
using StepSums = std::array<StepSum, VariableSteps::kCount>;

StepSums sums_over(const Records& records, std::size_t variable, const VariableSteps& steps,
                   const std::vector<double>& force_N) {
  StepSums sums;
  for (std::size_t i = 0; i < force_N.size(); ++i) {
    const int step = steps.of(records.variables[i][variable]);
    if (step < 0) continue;
    sums[static_cast<std::size_t>(step)].sum += force_N[i];
    ++sums[static_cast<std::size_t>(step)].count;
  }
  return sums;
}

/// Returns the sum of squares about the mean of all that the means of the steps explain.
double explained_N2(const StepSums& sums, double mean_N) {
  double explained = 0;
  for (const StepSum& step : sums)
    if (step.count > 0) explained += step.count * (step.mean() - mean_N) * (step.mean() - mean_N);
  return explained;
}

/// The force of one effect at each record along one axis, and what is measured of it.
struct EffectForce {
  std::vector<double> predicted_N, measured_N;
  double mean_N = 0, squares_N2 = 0;  ///< of predicted_N; squares about the mean
};

EffectForce effect_force(const Records& records, std::size_t with, std::size_t without, int axis) {
  EffectForce force;
  for (std::size_t i = 0; i < records.block.size(); ++i) {
    force.measured_N.push_back(static_cast<double>(records.residual_N[without][i][axis]));
    force.predicted_N.push_back(force.measured_N.back() -
                                static_cast<double>(records.residual_N[with][i][axis]));
    force.mean_N += force.predicted_N.back();
  }
  force.mean_N /= static_cast<double>(records.block.size());
  for (const double x : force.predicted_N) force.squares_N2 += (x - force.mean_N) * (x - force.mean_N);
  return force;
}

/// Joins steps to at most kBins bins, each with the same part of the range and of the way of the force over it.
std::array<std::size_t, VariableSteps::kCount> bins_of(const StepSums& sums) {
  constexpr double kBins = 24;
  std::array<double, VariableSteps::kCount> way;
  double last = 0, total = 0;
  bool has_last = false;
  for (std::size_t k = 0; k < way.size(); ++k) {
    if (sums[k].count > 0) {
      total += has_last ? std::abs(sums[k].mean() - last) : 0;
      last = sums[k].mean();
      has_last = true;
    }
    way[k] = total;
  }
  std::array<std::size_t, VariableSteps::kCount> bins;
  for (std::size_t k = 0; k < way.size(); ++k) {
    const double range = static_cast<double>(k) / VariableSteps::kCount;
    bins[k] = static_cast<std::size_t>((kBins - 1) * (total > 0 ? (range + way[k] / total) / 2 : range));
  }
  return bins;
}

/// Returns one bin of an effect's curve. The error is that of the mean over blocks, as records within a block are
/// correlated.
EffectCurve::Point point_of(const std::vector<std::size_t>& bin, const EffectForce& force,
                            const Records& records, std::size_t variable) {
  EffectCurve::Point point;
  std::map<int, std::pair<double, double>> blocks;  // sum, count
  for (const std::size_t i : bin) {
    point.at += static_cast<double>(records.variables[i][variable]);
    point.predicted_N += force.predicted_N[i];
    point.measured_N += force.measured_N[i];
    blocks[records.block[i]].first += force.measured_N[i];
    blocks[records.block[i]].second += 1;
  }
  const auto count = static_cast<double>(bin.size());
  point.records = bin.size();
  point.at /= count;
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

bool may_vary_with(const std::string& effect, std::size_t variable) {
  const stability::EffectTraits& traits = stability::traits_of(effect);
  return traits.variables.empty() || variable == kFromMiddle ||
         traits.varies_with(name_and_unit(variable).first);
}

EffectCurve effect_curve(const Records& records, const stability::EffectSpec& effect, std::size_t with,
                         std::size_t without) {
  constexpr std::size_t kFewest = 20;
  EffectCurve curve;
  curve.effect = effect.name + (effect.vehicle.empty() ? "" : " of " + effect.vehicle);
  if (records.block.empty()) return curve;
  double best_N2 = 0;
  std::size_t variable = kDrawable;
  EffectForce force;
  VariableSteps steps;
  StepSums sums;
  for (int axis = 0; axis < 3; ++axis) {
    EffectForce along = effect_force(records, with, without, axis);
    for (std::size_t v = 0; v < kDrawable && along.squares_N2 > best_N2; ++v) {
      const VariableSteps over = may_vary_with(effect.name, v) ? steps_over(records, v) : VariableSteps{};
      if (!(over.width > 0)) continue;
      const StepSums of = sums_over(records, v, over, along.predicted_N);
      const double explained = explained_N2(of, along.mean_N);
      if (!(explained > best_N2)) continue;
      best_N2 = explained;
      variable = v;
      force = along;
      steps = over;
      sums = of;
      curve.axis = "xyz"[axis];
    }
  }
  if (variable == kDrawable) return curve;  // an effect that is constant has no curve
  std::tie(curve.variable, curve.unit) = name_and_unit(variable);
  curve.share = std::min(1.0, best_N2 / force.squares_N2);
  const auto bin_of_step = bins_of(sums);
  std::vector<std::vector<std::size_t>> bins(bin_of_step.back() + 1);
  for (std::size_t i = 0; i < records.block.size(); ++i) {
    const int step = steps.of(records.variables[i][variable]);
    if (step >= 0) bins[bin_of_step[static_cast<std::size_t>(step)]].push_back(i);
  }
  for (const std::vector<std::size_t>& bin : bins)
    if (bin.size() >= kFewest) curve.points.push_back(point_of(bin, force, records, variable));
  return curve;
}

/// Sets the horizontal distance of every record from the middle of an effect that has one: its x_m and y_m.
void set_distance(const stability::EffectSpec& effect, Records& records) {
  const auto x_m = effect.parameters.find("x_m"), y_m = effect.parameters.find("y_m");
  const bool has_middle = x_m != effect.parameters.end() && y_m != effect.parameters.end();
  for (std::size_t i = 0; i < records.variables.size(); ++i)
    records.variables[i][kFromMiddle] =
        has_middle ? static_cast<float>(std::hypot(static_cast<double>(records.place_m[i].x()) - x_m->second,
                                                   static_cast<double>(records.place_m[i].y()) - y_m->second))
                   : std::numeric_limits<float>::quiet_NaN();
}

}  // namespace

PictureData picture_data(const residuals::Inputs& inputs, const stability::Model& before,
                         const stability::Model& after) {
  std::vector<stability::Model> models = {before, after};
  for (std::size_t k = 0; k < after.effects.size(); ++k) {
    models.push_back(after);
    models.back().effects.erase(models.back().effects.begin() + static_cast<std::ptrdiff_t>(k));
  }
  Records records = collect(inputs, models);
  PictureData data;
  data.room = room_map(records, 0, 1);
  for (std::size_t k = 0; k < after.effects.size(); ++k) {
    set_distance(after.effects[k], records);
    EffectCurve curve = effect_curve(records, after.effects[k], 1, 2 + k);
    if (curve.points.size() >= 3) data.effects.push_back(std::move(curve));
  }
  return data;
}

}  // namespace swarmcert::identification
