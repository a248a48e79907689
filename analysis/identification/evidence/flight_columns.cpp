#include "analysis/identification/evidence/flight_columns.h"

#include <algorithm>
#include <cmath>
#include <mutex>

#include "analysis/identification/column_run.h"
#include "analysis/identification/instrument.h"

namespace swarmcert::evidence {
namespace {

using identification::ModelledTrack;
using identification::ScanVariable;

std::vector<Stretch> stretches_of(const residuals::Track& track) {
  std::vector<double> times_s;
  std::vector<char> is_used;
  for (std::size_t i = 0; i < track.instants.size(); ++i) {
    times_s.push_back(track.instants[i].time_s);
    is_used.push_back(track.cut[i] == residuals::Cut::kNone ? 1 : 0);
  }
  return stretches(times_s, is_used, track.restarts);
}

/// Adds the values of all variables every 0.1 s.
void add_values(const residuals::Track& track, const std::vector<Stretch>& stretches,
                std::vector<std::vector<double>>& by_variable) {
  constexpr double kEvery_s = 0.1;
  for (const Stretch& stretch : stretches) {
    const int every = std::max(1, static_cast<int>(kEvery_s / stretch.step_s));
    for (int i = 0; i < stretch.count; i += every) {
      const identification::ScanValues values =
          identification::scan_values(track.instants[static_cast<std::size_t>(stretch.first + i)]);
      for (std::size_t v = 0; v < values.size(); ++v) {
        if (std::isfinite(values[v])) by_variable[v].push_back(values[v]);
      }
    }
  }
}

std::vector<CurveOver> curves_over(std::vector<std::vector<double>>& by_variable) {
  constexpr std::size_t kLeast = 50;
  std::vector<CurveOver> result;
  for (int v = 0; v < identification::kNumScanVariables; ++v) {
    std::vector<double>& values = by_variable[static_cast<std::size_t>(v)];
    if (values.size() < kLeast) continue;
    const auto variable = static_cast<ScanVariable>(v);
    const Curve curve(values);
    const identification::ScanVariableInfo& info = identification::scan_variable(variable);
    if (!curve.varies()) continue;
    for (int axis = 0; axis < 3; ++axis) {
      if (info.in_world) result.push_back({variable, Frame::kWorld, axis, curve});
      if (info.in_body) result.push_back({variable, Frame::kBody, axis, curve});
    }
    if (variable == ScanVariable::kSpeed) result.push_back({variable, Frame::kVelocity, 0, curve});
  }
  return result;
}

}  // namespace

Eigen::Vector3d CurveOver::direction(const stability::Instant& now) const {
  switch (frame) {
    case Frame::kWorld:
      return Eigen::Vector3d::Unit(axis);
    case Frame::kBody:
      return now.R_WB.col(axis);
    case Frame::kVelocity:
      return now.v_W_m_s.normalized();
  }
  return Eigen::Vector3d::Zero();
}

Survey survey(const identification::Passes& passes) {
  Survey result;
  result.tracks.resize(passes.flights.size());
  std::vector<std::vector<double>> by_variable(identification::kNumScanVariables);
  std::mutex mutex;
  over_modelled_tracks(passes, [&](std::size_t k, const ModelledTrack& modelled) {
    PlacedTrack placed{stretches_of(modelled.track), 0};
    const std::lock_guard<std::mutex> lock(mutex);
    add_values(modelled.track, placed.stretches, by_variable);
    result.tracks[k].push_back(std::move(placed));
    std::vector<std::string>& vehicles = result.vehicles;
    if (std::find(vehicles.begin(), vehicles.end(), modelled.track.vehicle) == vehicles.end())
      vehicles.push_back(modelled.track.vehicle);
  });
  for (std::vector<PlacedTrack>& flight : result.tracks) {
    for (PlacedTrack& placed : flight) {
      placed.first_stretch = result.stretches.size();
      result.stretches.insert(result.stretches.end(), placed.stretches.begin(), placed.stretches.end());
    }
  }
  result.curves = curves_over(by_variable);
  return result;
}

TrackColumns::TrackColumns(const identification::Passes& passes, const ModelledTrack& modelled,
                           const identification::Grams& grams, const std::vector<CurveOver>& curves,
                           const std::vector<stability::Instant>& instants) {
  const auto records = static_cast<Eigen::Index>(instants.size());
  const Eigen::Index all = width(grams, curves);
  for (Eigen::MatrixXf& axis : values_) axis.setZero(records, all + 1);
  add_effects(passes, modelled, grams, instants);
  add_curves(passes, modelled, curves, instants);
  for (Eigen::Index i = 0; i < records; ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      values_[axis](i, all) = static_cast<float>(
          modelled.residual_N[static_cast<std::size_t>(i)][static_cast<Eigen::Index>(axis)]);
  }
}

void TrackColumns::add_effects(const identification::Passes& passes, const ModelledTrack& modelled,
                               const identification::Grams& grams,
                               const std::vector<stability::Instant>& instants) {
  identification::ColumnRun run(grams, passes.inputs, modelled.model, modelled.track);
  run.along(instants, [&](std::size_t i, const Eigen::Matrix3Xd& columns) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      values_[axis].row(static_cast<Eigen::Index>(i)).head(columns.cols()) =
          columns.row(static_cast<Eigen::Index>(axis)).cast<float>();
  });
}

void TrackColumns::add_curves(const identification::Passes& passes, const ModelledTrack& modelled,
                              const std::vector<CurveOver>& curves,
                              const std::vector<stability::Instant>& instants) {
  const Eigen::Index count = static_cast<Eigen::Index>(curves.size()) * Curve::kSize + 6;
  const Eigen::Index first = values_[0].cols() - 1 - count;
  residuals::MeasuredForce measured(modelled.track, modelled.model, static_cast<int>(count));
  Eigen::Matrix3Xd forces(3, count);
  for (std::size_t i = 0; i < instants.size(); ++i) {
    if (modelled.track.restarts[i] != 0) measured.restart();
    const stability::Instant& now = instants[i];
    const identification::ScanValues values = identification::scan_values(now);
    for (std::size_t c = 0; c < curves.size(); ++c) {
      const double value = values[static_cast<std::size_t>(curves[c].variable)];
      auto force = forces.middleCols<Curve::kSize>(static_cast<Eigen::Index>(c) * Curve::kSize);
      force.setZero();
      if (std::isfinite(value)) force = curves[c].direction(now) * curves[c].curve(value).transpose();
    }
    forces.rightCols<6>() << now.R_WB, now.thrust_N * now.R_WB.leftCols<2>(), Eigen::Vector3d::Zero();
    if (!passes.inputs.rules.has_published_signals()) measured.apply(now, forces);
    for (std::size_t axis = 0; axis < 3; ++axis)
      values_[axis].row(static_cast<Eigen::Index>(i)).segment(first, count) =
          forces.row(static_cast<Eigen::Index>(axis)).cast<float>();
  }
}

std::array<Eigen::MatrixXf, 3> wanted_columns(const identification::Passes& passes,
                                              const ModelledTrack& modelled,
                                              const identification::Grams& grams,
                                              const std::vector<CurveOver>& curves) {
  const residuals::Track& track = modelled.track;
  if (track.targets.size() != track.instants.size()) return {};
  const std::vector<stability::Instant> wanted = identification::as_commanded(track, modelled.model.mass_kg);
  const TrackColumns columns(passes, modelled, grams, curves, wanted);
  const Eigen::Index width = columns.along(0).cols() - 1;
  return {columns.along(0).leftCols(width), columns.along(1).leftCols(width),
          columns.along(2).leftCols(width)};
}

}  // namespace swarmcert::evidence
