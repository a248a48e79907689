#include "analysis/identification/balance/motion_estimates.h"

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "analysis/identification/balance/force_means.h"
#include "nn/base/pi.h"

namespace swarmcert::identification {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using residuals::Track;

constexpr double kMotionStretch_s = 0.5, kTurnStretch_s = 0.1;
constexpr double kLargestLag_s = 0.2;
constexpr Eigen::Index kFewestRows = 20;

/// A state of the vehicle between two records.
struct MotionState {
  Vector3d p_m, v_m_s;
  Eigen::Quaterniond q;
};

std::optional<MotionState> state_at(const Track& track, double time_s) {
  constexpr double kLongestGap_s = 0.05;
  const auto after = std::lower_bound(track.instants.begin(), track.instants.end(), time_s,
                                      [](const stability::Instant& now, double t) { return now.time_s < t; });
  if (after == track.instants.begin() || after == track.instants.end()) return std::nullopt;
  const stability::Instant &b = *after, &a = *(after - 1);
  if (b.time_s - a.time_s > kLongestGap_s) return std::nullopt;
  const double share = (time_s - a.time_s) / (b.time_s - a.time_s);
  return MotionState{a.p_W_m + share * (b.p_W_m - a.p_W_m), a.v_W_m_s + share * (b.v_W_m_s - a.v_W_m_s),
                     Eigen::Quaterniond(a.R_WB).slerp(share, Eigen::Quaterniond(b.R_WB))};
}

/// The states at the ends of a stretch, read later by a lag.
struct MotionEnds {
  MotionState from, to;
};

std::optional<MotionEnds> ends_of(const Track& track, const ForceMean& stretch, double lag_s) {
  const auto from = state_at(track, track.instants[stretch.first].time_s + lag_s),
             to = state_at(track, track.instants[stretch.last].time_s + lag_s);
  if (!from || !to) return std::nullopt;
  return MotionEnds{*from, *to};
}

double duration_s(const Track& track, const ForceMean& stretch) {
  return track.instants[stretch.last].time_s - track.instants[stretch.first].time_s;
}

/// Returns the mean of a signal over a stretch, by the trapezoidal rule.
Vector3d mean_over(const Track& track, const ForceMean& stretch, Vector3d stability::Instant::*signal) {
  Vector3d sum = Vector3d::Zero();
  for (std::size_t i = stretch.first + 1; i <= stretch.last; ++i) {
    const stability::Instant &before = track.instants[i - 1], &now = track.instants[i];
    sum += (now.time_s - before.time_s) / 2 * (now.*signal + before.*signal);
  }
  return sum / duration_s(track, stretch);
}

/// Rows of a least squares problem. The last parameter is the lag of the left side.
struct MotionRows {
  std::vector<VectorXd> rows;
  std::vector<double> values;

  void add(double value, const VectorXd& row) {
    values.push_back(value);
    rows.push_back(row);
  }
};

struct MotionSolution {
  VectorXd parameters;         ///< empty: too few rows, or a lag beyond kLargestLag_s
  double mean_square = 0;      ///< of what the parameters leave
  double explained_share = 0;  ///< of the sum of squares of the left side
};

/// Solves for all parameters; the left side is read later by the lag until the lag is constant.
/// @param rows_at lag [s] -> rows
template <typename RowsAt>
MotionSolution solve_with_lag(const RowsAt& rows_at) {
  constexpr int kRounds = 5;
  double lag_s = 0;
  MotionSolution solution;
  for (int round = 0; round < kRounds; ++round) {
    const MotionRows read = rows_at(lag_s);
    const auto n = static_cast<Eigen::Index>(read.rows.size());
    if (n < kFewestRows) return {};
    MatrixXd A(n, read.rows[0].size());
    for (Eigen::Index i = 0; i < n; ++i) A.row(i) = read.rows[static_cast<std::size_t>(i)];
    const Eigen::Map<const VectorXd> y(read.values.data(), n);
    const Eigen::ColPivHouseholderQR<MatrixXd> qr(A);
    if (qr.rank() < A.cols()) return {};
    solution.parameters = qr.solve(y);
    const double left = (y - A * solution.parameters).squaredNorm();
    solution.mean_square = left / static_cast<double>(n);
    solution.explained_share = 1 - left / y.squaredNorm();
    const double step_s = solution.parameters(A.cols() - 1);
    solution.parameters(A.cols() - 1) += lag_s;
    lag_s += step_s;
    if (!(std::abs(lag_s) < kLargestLag_s)) return {};
  }
  return solution;
}

/// Stretches of a part of a track.
using Stretches = std::vector<ForceMean>;

Vector3d turned_left(const Vector3d& a) { return {-a.y(), a.x(), 0}; }

/// Fits dp/dt = c (v + psi e3 x v - lag dv/dt). Noise of the velocity makes c too small. Noise of the position makes
/// the slope of the opposite regression, which is explained_share / c, too small. The scale of the velocity, 1 / c
/// without noise, is between the two.
void compare_positions(const Track& track, const Stretches& stretches, MotionEstimates& found) {
  const auto rows_at = [&](double lag_s) {
    MotionRows read;
    for (const ForceMean& one : stretches) {
      const std::optional<MotionEnds> ends = ends_of(track, one, lag_s);
      if (!ends) continue;
      const stability::Instant &from = track.instants[one.first], &to = track.instants[one.last];
      const double time_s = duration_s(track, one);
      const Vector3d seen = (ends->to.p_m - ends->from.p_m) / time_s,
                     v = mean_over(track, one, &stability::Instant::v_W_m_s), turned = turned_left(v),
                     change = (to.v_W_m_s - from.v_W_m_s) / time_s;
      for (int axis = 0; axis < 3; ++axis)
        read.add(seen(axis), Vector3d(v(axis), turned(axis), -change(axis)));
    }
    return read;
  };
  const MotionSolution solution = solve_with_lag(rows_at);
  if (solution.parameters.size() == 0 || !(solution.parameters(0) > 0)) return;
  found["largest_velocity_scale"] = 1 / solution.parameters(0);
  found["least_velocity_scale"] = solution.explained_share / solution.parameters(0);
  found["position_lag_s"] = solution.parameters(2);
}

/// Fits the horizontal part of dv/dt = c (x + psi e3 x x - lag dx/dt) + b, x = R a, for specific forces a. A tilt
/// appears as b = g tilt, constant in W or in the body. Noise of x makes c too small, but psi stays right.
void compare_horizontally(const Track& track, const Stretches& stretches, MotionEstimates& found) {
  const auto solution_with = [&](bool is_in_body) {
    return solve_with_lag([&](double lag_s) {
      MotionRows read;
      for (const ForceMean& one : stretches) {
        const std::optional<MotionEnds> ends = ends_of(track, one, lag_s);
        if (!ends) continue;
        const double time_s = duration_s(track, one);
        const Vector3d seen = (ends->to.v_m_s - ends->from.v_m_s) / time_s, x = one.mean_m_s2,
                       turned = turned_left(x),
                       change = (track.specific_force_m_s2[one.last] - track.specific_force_m_s2[one.first]) /
                                time_s;
        const Eigen::Matrix3d axes =
            is_in_body ? track.instants[(one.first + one.last) / 2].R_WB : Eigen::Matrix3d::Identity();
        for (int axis = 0; axis < 2; ++axis) {
          VectorXd row(5);
          row << x(axis), turned(axis), axes(axis, 0), axes(axis, 1), -change(axis);
          read.add(seen(axis), row);
        }
      }
      return read;
    });
  };
  const MotionSolution in_W = solution_with(false), in_body = solution_with(true);
  if (in_W.parameters.size() == 0 || in_body.parameters.size() == 0) return;
  const VectorXd& best = (in_body.mean_square < in_W.mean_square ? in_body : in_W).parameters;
  found["heading_rad"] = best(1) / best(0);
  found["velocity_lag_s"] = best(4);
  // Each unit has both, because the frame is chosen for all units together.
  for (const auto& [name, one] : {std::pair("W", in_W), std::pair("B", in_body)}) {
    found[std::string("tilt_x_") + name] = one.parameters(2) / stability::kGravity_m_s2;
    found[std::string("tilt_y_") + name] = one.parameters(3) / stability::kGravity_m_s2;
    found[std::string("square_") + name] = one.mean_square;
  }
}

/// Fits turn / time = c (omega - lag domega/dt) + b about the x and y axes of the body.
void compare_turns(const Track& track, const Stretches& stretches, MotionEstimates& found) {
  const MotionSolution solution = solve_with_lag([&](double lag_s) {
    MotionRows read;
    for (const ForceMean& one : stretches) {
      const std::optional<MotionEnds> ends = ends_of(track, one, lag_s);
      if (!ends) continue;
      const stability::Instant &from = track.instants[one.first], &to = track.instants[one.last];
      const double time_s = duration_s(track, one);
      const Vector3d omega_rad_s = mean_over(track, one, &stability::Instant::omega_B_rad_s),
                     change = (to.omega_B_rad_s - from.omega_B_rad_s) / time_s;
      const Eigen::AngleAxisd seen(ends->from.q.conjugate() * ends->to.q);
      const double angle_rad = seen.angle() > kPi ? seen.angle() - 2 * kPi : seen.angle();
      for (int axis = 0; axis < 2; ++axis) {
        VectorXd row(4);
        row << omega_rad_s(axis), axis == 0 ? 1 : 0, axis == 1 ? 1 : 0, -change(axis);
        read.add(angle_rad * seen.axis()(axis) / time_s, row);
      }
    }
    return read;
  });
  if (solution.parameters.size() > 0) found["attitude_lag_s"] = solution.parameters(3);
}

/// Splits the stretches of a track into parts of at least `part_s`.
std::vector<Stretches> parts_of(const Track& track, const Stretches& all, double part_s) {
  std::vector<Stretches> parts;
  double sum_s = 0;
  for (const ForceMean& one : all) {
    if (parts.empty() || sum_s >= part_s) {
      parts.emplace_back();
      sum_s = 0;
    }
    parts.back().push_back(one);
    sum_s += duration_s(track, one);
  }
  return parts;
}

}  // namespace

std::vector<MotionEstimates> motion_estimates(const Track& track, bool measures_velocity, double part_s) {
  std::vector<MotionEstimates> units;
  const bool has_accelerometer =
      track.force_source == logs::ForceSource::kAccelerometer && track.judged.minCoeff() > 0;
  if (measures_velocity) {
    for (const Stretches& part : parts_of(track, specific_force_means(track, kMotionStretch_s), part_s)) {
      units.emplace_back();
      compare_positions(track, part, units.back());
      if (has_accelerometer) compare_horizontally(track, part, units.back());
    }
  }
  if (track.has_rates && has_accelerometer) {
    for (const Stretches& part : parts_of(track, specific_force_means(track, kTurnStretch_s), part_s)) {
      units.emplace_back();
      compare_turns(track, part, units.back());
    }
  }
  return units;
}

}  // namespace swarmcert::identification
