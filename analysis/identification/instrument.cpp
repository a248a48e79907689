#include "analysis/identification/instrument.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "analysis/identification/column_run.h"
#include "nn/files/parallel.h"

namespace swarmcert::identification {
namespace {

using residuals::Track;

constexpr double kQuantile90 = 1.6449;  // two-sided 90 % of the normal distribution

/// The track as set points ask for it: position, velocity, and the thrust and attitude that would follow them.
/// Neighbours stay where they were seen.
std::vector<stability::Instant> as_commanded(const Track& track, double mass_kg) {
  constexpr std::ptrdiff_t kHalfWindow = 3;  // of the difference that gives the acceleration
  constexpr double kMostAcceleration_m_s2 = 5;
  std::vector<stability::Instant> wanted = track.instants;
  const auto n = static_cast<std::ptrdiff_t>(wanted.size());
  for (std::ptrdiff_t i = 0; i < n; ++i) {
    stability::Instant& now = wanted[static_cast<std::size_t>(i)];
    const stability::Setpoint& target = track.targets[static_cast<std::size_t>(i)];
    now.p_W_m = target.p_W_m;
    now.v_W_m_s = target.v_W_m_s;
    const auto a = static_cast<std::size_t>(std::max<std::ptrdiff_t>(i - kHalfWindow, 0));
    const auto b = static_cast<std::size_t>(std::min(i + kHalfWindow, n - 1));
    const double span_s = track.instants[b].time_s - track.instants[a].time_s;
    Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();
    if (span_s > 0) acceleration = (track.targets[b].v_W_m_s - track.targets[a].v_W_m_s) / span_s;
    if (acceleration.norm() > kMostAcceleration_m_s2)
      acceleration *= kMostAcceleration_m_s2 / acceleration.norm();
    const Eigen::Vector3d force_N =
        mass_kg * (acceleration + Eigen::Vector3d(0, 0, stability::kGravity_m_s2));
    now.thrust_N = force_N.norm();
    const Eigen::Matrix3d R = now.R_WB;
    now.R_WB = Eigen::Quaterniond::FromTwoVectors(R.col(2), force_N).toRotationMatrix() * R;
  }
  return wanted;
}

/// Sums of one block.
struct Moments {
  Eigen::MatrixXd zx, xx;
  Eigen::VectorXd zr, xr;
};

bool add_track(const residuals::Inputs& inputs, const Track& track, const Grams& columns,
               std::vector<Moments>& blocks) {
  if (track.targets.size() != track.instants.size()) return false;
  const stability::Model& model = inputs.model_for(track);
  const std::vector<Eigen::Vector3d> r = residuals::force_residual(model, inputs.kinds, inputs.rules, track);
  const std::vector<stability::Instant> wanted = as_commanded(track, model.mass_kg);
  const TrackBlocks cut = cut_into_blocks(track);
  ColumnRun actual(columns, inputs, model, track.vehicle), commanded(columns, inputs, model, track.vehicle);
  const std::size_t first = blocks.size();
  const int n = columns.columns;
  blocks.resize(first + cut.blocks.size(), {Eigen::MatrixXd::Zero(n, n), Eigen::MatrixXd::Zero(n, n),
                                            Eigen::VectorXd::Zero(n), Eigen::VectorXd::Zero(n)});
  for (std::size_t i = 0; i < track.instants.size(); ++i) {
    const bool restart = track.restarts[i] != 0;
    const Eigen::Matrix3Xd& x = actual.advance(track.instants[i], restart);
    const Eigen::Matrix3Xd& z = commanded.advance(wanted[i], restart);
    if (cut.of_record[i] < 0) continue;
    Moments& to = blocks[first + static_cast<std::size_t>(cut.of_record[i])];
    to.zx.noalias() += z.transpose() * x;
    to.xx.noalias() += x.transpose() * x;
    to.zr.noalias() += z.transpose() * r[i];
    to.xr.noalias() += x.transpose() * r[i];
  }
  return true;
}

}  // namespace

bool InstrumentedValue::is_strong() const {
  return interval.second - interval.first < std::abs(least_squares);
}

bool InstrumentedValue::contradicts() const {
  constexpr double kSurely_z = 3, kMost = 0.5;
  return is_strong() && std::abs(difference_z) > kSurely_z &&
         instrument * least_squares < kMost * least_squares * least_squares;
}

double InstrumentedValue::bias() const {
  if (!is_strong() || std::abs(difference_z) <= 1) return 0;
  return std::abs(instrument - least_squares) * std::sqrt(1 - 1 / (difference_z * difference_z));
}

void widen_by_bias(const std::vector<std::vector<InstrumentedValue>>& checks, std::vector<Refined>& refined) {
  // By the bias to both sides, and to where the instrument's own interval ends.
  const auto widen = [](Interval& interval, const InstrumentedValue& check, double scale,
                        const stability::Parameter& parameter) {
    if (!check.is_strong()) return;
    const double by = scale * check.bias();
    interval.first = std::max(std::min(interval.first - by, scale * check.interval.first), parameter.lower);
    interval.second =
        std::min(std::max(interval.second + by, scale * check.interval.second), parameter.upper);
  };
  for (std::size_t i = 0; i < checks.size(); ++i) {
    Refined& effect = refined[i];
    const stability::EffectInfo& info = effect.candidate.info;
    if (info.remembers) {
      widen(effect.shape_intervals[0], checks[i][0], effect.theta[0], info.shape[0]);
      continue;
    }
    for (std::size_t c = 0; c < checks[i].size(); ++c)
      widen(effect.linear_intervals[c], checks[i][c], 1, info.linear[c]);
  }
}

std::vector<std::vector<InstrumentedValue>> instrument(const Passes& passes,
                                                       const std::vector<Candidate>& effects) {
  const Grams columns = columns_of(effects);
  const auto n = static_cast<Eigen::Index>(columns.columns);
  std::vector<std::vector<Moments>> pieces(passes.flights.size());
  std::vector<char> complete(passes.flights.size(), 1);
  files::parallel_for(static_cast<int>(passes.flights.size()), passes.jobs, [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    std::vector<std::string> problems;
    for (const Track& track : passes.inputs.load(static_cast<std::size_t>(passes.flights[k]), problems)) {
      if (track.position_only || track.kind != passes.kind) continue;
      if (!add_track(passes.inputs, track, columns, pieces[k])) complete[k] = 0;
    }
  });
  if (n == 0 || std::find(complete.begin(), complete.end(), 0) != complete.end()) return {};
  Moments sum{Eigen::MatrixXd::Zero(n, n), Eigen::MatrixXd::Zero(n, n), Eigen::VectorXd::Zero(n),
              Eigen::VectorXd::Zero(n)};
  for (const auto& piece : pieces) {
    for (const Moments& block : piece) {
      sum.zx += block.zx;
      sum.xx += block.xx;
      sum.zr += block.zr;
      sum.xr += block.xr;
    }
  }
  const Eigen::FullPivLU<Eigen::MatrixXd> zx(sum.zx), xx(sum.xx);
  if (!zx.isInvertible() || !xx.isInvertible()) return {};
  const Eigen::VectorXd by_instrument = zx.solve(sum.zr), by_squares = xx.solve(sum.xr);
  Eigen::VectorXd variance = Eigen::VectorXd::Zero(n), difference = variance;
  for (const auto& piece : pieces) {
    for (const Moments& block : piece) {
      const Eigen::VectorXd a = zx.solve(block.zr - block.zx * by_instrument);
      const Eigen::VectorXd b = xx.solve(block.xr - block.xx * by_squares);
      variance += a.cwiseAbs2();
      difference += (a - b).cwiseAbs2();
    }
  }
  std::vector<std::vector<InstrumentedValue>> result;
  Eigen::Index at = 0;
  for (const Candidate& effect : effects) {
    result.emplace_back();
    for (int c = 0; c < effect.columns(); ++c, ++at) {
      InstrumentedValue value;
      value.least_squares = by_squares[at];
      value.instrument = by_instrument[at];
      const double half = kQuantile90 * std::sqrt(variance[at]);
      value.interval = {value.instrument - half, value.instrument + half};
      const double deviation = std::sqrt(difference[at]);
      value.difference_z = deviation > 0 ? (value.instrument - value.least_squares) / deviation : 0;
      result.back().push_back(value);
    }
  }
  return result;
}

}  // namespace swarmcert::identification
