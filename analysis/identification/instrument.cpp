#include "analysis/identification/instrument.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "analysis/identification/block_rows.h"
#include "analysis/identification/covariance.h"

namespace swarmcert::identification {
namespace {

using residuals::Track;

constexpr double kQuantile90 = 1.6449;  // two-sided 90 % of the normal distribution

/// Sums over a block.
struct Moments {
  Eigen::MatrixXd zx, xx;
  Eigen::VectorXd zr, xr;
  bool follows = false;  ///< directly follows the previous block of the same track
};

/// Returns columns * mix for a sparse `mix`.
Eigen::MatrixXd mixed(const Eigen::MatrixXd& columns, const Eigen::MatrixXd& mix) {
  Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(columns.rows(), mix.cols());
  for (Eigen::Index j = 0; j < mix.cols(); ++j) {
    for (Eigen::Index i = 0; i < mix.rows(); ++i) {
      if (mix(i, j) != 0) sums.col(j) += mix(i, j) * columns.col(i);
    }
  }
  return sums;
}

/// Returns the sums of each block.
/// @param flown, wanted columns_along() the track as flown and as commanded by setpoints
/// @param mix [columns x unknowns]: the fitted unknowns as combinations of columns
std::vector<Moments> moments_of(const ModelledTrack& track, const Eigen::MatrixXd& flown,
                                const Eigen::MatrixXd& wanted, const Eigen::MatrixXd& mix) {
  const Eigen::MatrixXd x_of_all = mixed(flown, mix), z_of_all = mixed(wanted, mix);
  const Eigen::VectorXd r_of_all = residual_along(track);
  std::vector<Moments> blocks;
  for (const TrackBlock& block : track.cut.blocks) {
    const Eigen::Index first = block.first_row, rows = Eigen::Index(3) * block.records;
    const auto x = x_of_all.middleRows(first, rows), z = z_of_all.middleRows(first, rows);
    const auto r = r_of_all.segment(first, rows);
    blocks.push_back(
        {z.transpose() * x, x.transpose() * x, z.transpose() * r, x.transpose() * r, block.follows});
  }
  return blocks;
}

/// Returns both estimates of each unknown. Empty if a log has no setpoints or nothing moves.
std::vector<InstrumentedValue> estimates(const Passes& passes, const Grams& columns,
                                         const Eigen::MatrixXd& mix) {
  const Eigen::Index n = mix.cols();
  std::vector<std::vector<Moments>> pieces(passes.flights.size());
  std::vector<char> complete(passes.flights.size(), 1);
  over_modelled_tracks(passes, [&](std::size_t k, const ModelledTrack& modelled) {
    const Track& track = modelled.track;
    if (track.targets.size() != track.instants.size()) complete[k] = 0;
    if (n == 0 || complete[k] == 0) return;
    const Eigen::MatrixXd flown = columns_along(passes.inputs, modelled, columns, track.instants);
    const Eigen::MatrixXd wanted =
        columns_along(passes.inputs, modelled, columns, as_commanded(track, modelled.model.mass_kg));
    for (Moments& block : moments_of(modelled, flown, wanted, mix)) pieces[k].push_back(std::move(block));
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
  Eigen::VectorXd difference = Eigen::VectorXd::Zero(n);
  std::vector<std::vector<double>> influences(static_cast<std::size_t>(n));
  std::vector<char> follows;
  for (const auto& piece : pieces) {
    for (const Moments& block : piece) {
      const Eigen::VectorXd a = zx.solve(block.zr - block.zx * by_instrument);
      const Eigen::VectorXd b = xx.solve(block.xr - block.xx * by_squares);
      for (Eigen::Index at = 0; at < n; ++at) influences[static_cast<std::size_t>(at)].push_back(a[at]);
      follows.push_back(block.follows ? 1 : 0);
      difference += (a - b).cwiseAbs2();
    }
  }
  std::vector<InstrumentedValue> values;
  for (Eigen::Index at = 0; at < n; ++at) {
    InstrumentedValue value;
    value.least_squares = by_squares[at];
    value.instrument = by_instrument[at];
    const double half =
        kQuantile90 * std::sqrt(long_run_variance(influences[static_cast<std::size_t>(at)], follows));
    value.interval = {value.instrument - half, value.instrument + half};
    const double deviation = std::sqrt(difference[at]);
    value.difference_z = deviation > 0 ? (value.instrument - value.least_squares) / deviation : 0;
    values.push_back(value);
  }
  return values;
}

/// Converts the coefficients in `mix` to those of the model: see scaled_stages().
void scale_stages(const std::vector<Candidate>& effects, const Grams& columns, Eigen::MatrixXd& mix) {
  std::vector<const Candidate*> all;
  for (const Candidate& effect : effects) all.push_back(&effect);
  for (const ScaledStage& pair : scaled_stages(all)) {
    const Eigen::Index scale = columns.first_column[pair.scale][0];
    const Eigen::Index stage = columns.first_column[pair.stage][0];
    mix.row(stage) += mix.row(scale) / effects[pair.stage].scale;
  }
}

/// A shape that is estimated as well; its derivative is a difference of columns.
struct FreeShape {
  std::size_t effect, index;
  std::size_t neighbour;  ///< theta index in the effect's candidate; the shape itself is the first
  double width;
};

constexpr std::ptrdiff_t kHalfWindow = 3;  // of the differences for accelerations and body rates

/// Sets the roll and pitch rates with which the commanded thrust axis rotates.
void set_commanded_rates(std::vector<stability::Instant>& wanted) {
  const auto n = static_cast<std::ptrdiff_t>(wanted.size());
  for (std::ptrdiff_t i = 0; i < n; ++i) {
    stability::Instant& now = wanted[static_cast<std::size_t>(i)];
    const stability::Instant& before =
        wanted[static_cast<std::size_t>(std::max<std::ptrdiff_t>(i - kHalfWindow, 0))];
    const stability::Instant& after = wanted[static_cast<std::size_t>(std::min(i + kHalfWindow, n - 1))];
    const double span_s = after.time_s - before.time_s;
    Eigen::Vector3d turn_B_s = Eigen::Vector3d::Zero();  // b3' = omega x b3
    if (span_s > 0) turn_B_s = now.R_WB.transpose() * (after.b3_W() - before.b3_W()) / span_s;
    now.omega_B_rad_s.x() = -turn_B_s.y();
    now.omega_B_rad_s.y() = turn_B_s.x();
  }
}

}  // namespace

std::vector<stability::Instant> as_commanded(const Track& track, double mass_kg) {
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
  set_commanded_rates(wanted);
  return wanted;
}

bool InstrumentedValue::is_strong() const {
  return interval.upper - interval.lower < std::abs(least_squares);
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

std::vector<std::vector<InstrumentedValue>> instrument(const Passes& passes,
                                                       const std::vector<Candidate>& effects) {
  const Grams columns = columns_of(effects);
  std::vector<char> varies;
  for (const Candidate& effect : effects) {
    for (const stability::Parameter& coefficient : effect.info.linear)
      varies.push_back(is_held_at_zero(coefficient) ? 0 : 1);
  }
  Eigen::MatrixXd mix =
      Eigen::MatrixXd::Zero(columns.columns, std::count(varies.begin(), varies.end(), char{1}));
  for (Eigen::Index i = 0, to = 0; i < columns.columns; ++i) {
    if (varies[static_cast<std::size_t>(i)] != 0) mix(i, to++) = 1;
  }
  scale_stages(effects, columns, mix);
  const std::vector<InstrumentedValue> values = estimates(passes, columns, mix);
  if (values.empty()) return {};
  std::vector<std::vector<InstrumentedValue>> result;
  auto next = values.begin();
  auto is_free = varies.begin();
  for (const Candidate& effect : effects) {
    result.emplace_back(effect.info.linear.size());
    for (InstrumentedValue& value : result.back()) {
      if (*is_free++ != 0) value = *next++;
    }
  }
  return result;
}

std::vector<InstrumentedShape> instrument_with_shapes(const Passes& passes,
                                                      const std::vector<Refined>& refined) {
  constexpr double kDifference = 0.02;  // of the shape
  std::vector<Candidate> around;
  std::vector<FreeShape> free;
  for (std::size_t e = 0; e < refined.size(); ++e) {
    const Refined& effect = refined[e];
    around.push_back(effect.candidate);
    std::vector<std::vector<double>>& thetas = around.back().thetas;
    thetas = {effect.theta};
    if (effect.candidate.info.remembers) continue;
    for (std::size_t i = 0; i < effect.theta.size(); ++i) {
      const bool varies = effect.shape_intervals[i].lower < effect.shape_intervals[i].upper;
      if (!varies || effect.theta[i] == 0) continue;
      free.push_back({e, i, thetas.size(), kDifference * effect.theta[i]});
      thetas.push_back(effect.theta);
      thetas.back()[i] += free.back().width;
    }
  }
  if (free.empty()) return {};
  const Grams columns = columns_of(around);
  Eigen::Index unknowns = static_cast<Eigen::Index>(free.size());
  for (const Candidate& effect : around) unknowns += effect.columns();
  Eigen::MatrixXd mix = Eigen::MatrixXd::Zero(columns.columns, unknowns);
  Eigen::Index at = 0;
  for (std::size_t e = 0; e < around.size(); ++e) {
    for (int c = 0; c < around[e].columns(); ++c) mix(columns.first_column[e][0] + c, at++) = 1;
  }
  scale_stages(around, columns, mix);
  for (const FreeShape& shape : free) {
    for (int c = 0; c < around[shape.effect].columns(); ++c) {
      const double slope = refined[shape.effect].coefficients[static_cast<std::size_t>(c)] / shape.width;
      mix(columns.first_column[shape.effect][shape.neighbour] + c, at) += slope;
      mix(columns.first_column[shape.effect][0] + c, at) -= slope;
    }
    ++at;
  }
  const std::vector<InstrumentedValue> values = estimates(passes, columns, mix);
  if (values.empty()) return {};
  std::vector<InstrumentedShape> result;
  auto next = values.begin();
  for (const Refined& effect : refined) {
    const int count = effect.candidate.columns();
    result.push_back({{next, next + count}, std::vector<InstrumentedValue>(effect.theta.size())});
    next += count;
  }
  for (const FreeShape& shape : free) {
    InstrumentedValue value = *next++;  // a change of the shape
    const double from = refined[shape.effect].theta[shape.index];
    value.least_squares += from;
    value.instrument += from;
    value.interval = {value.interval.lower + from, value.interval.upper + from};
    result[shape.effect].shapes[shape.index] = value;
  }
  return result;
}

namespace {

/// The reaction of thrust to gusts makes a lag appear longer, and no filter removes all of it: thrust falls with the
/// velocity caused by a gust. If setpoints give a smaller value than least squares, the lag may be as short as they
/// allow, however weak they are.
void reach_down(Refined& lag, const InstrumentedValue& check) {
  constexpr double kBeyondChance_z = 1;
  if (check.difference_z >= -kBeyondChance_z) return;
  double& lower = lag.shape_intervals[0].lower;
  lower = std::max(std::min(lower, lag.theta[0] * check.interval.lower), lag.candidate.info.shape[0].lower);
}

}  // namespace

void widen_by_bias(const std::vector<std::vector<InstrumentedValue>>& checks,
                   const std::vector<InstrumentedShape>& with_shapes, std::vector<Refined>& refined) {
  // Widens by the bias on both sides, and to the ends of the instrument's own interval.
  const auto widen = [](Interval& interval, const InstrumentedValue& check, double scale,
                        const stability::Parameter& parameter) {
    if (!check.is_strong()) return;
    const double by = scale * check.bias();
    interval.lower = std::max(std::min(interval.lower - by, scale * check.interval.lower), parameter.lower);
    interval.upper = std::min(std::max(interval.upper + by, scale * check.interval.upper), parameter.upper);
  };
  for (std::size_t i = 0; i < checks.size(); ++i) {
    Refined& effect = refined[i];
    const stability::EffectInfo& info = effect.candidate.info;
    if (info.remembers) {
      widen(effect.shape_intervals[0], checks[i][0], effect.theta[0], info.shape[0]);
      reach_down(effect, checks[i][0]);
      continue;
    }
    for (std::size_t c = 0; c < checks[i].size(); ++c) {
      const bool with_shape = !with_shapes.empty() && with_shapes[i].coefficients[c].is_strong();
      widen(effect.linear_intervals[c], with_shape ? with_shapes[i].coefficients[c] : checks[i][c], 1,
            info.linear[c]);
    }
    // An error of the shape multiplies the coefficient, so a coefficient of known sign may be too small by the same
    // factor as too large.
    const bool has_free_shape =
        std::any_of(effect.shape_intervals.begin(), effect.shape_intervals.end(),
                    [](const Interval& interval) { return interval.lower < interval.upper; });
    for (std::size_t c = 0; has_free_shape && c < effect.coefficients.size(); ++c) {
      const double value = effect.coefficients[c];
      Interval& interval = effect.linear_intervals[c];
      if (info.linear[c].lower >= 0 && value > 0) {
        const double times = std::exp((interval.upper - value) / value);
        interval.upper = std::min(value * times, info.linear[c].upper);
      }
    }
    for (std::size_t k = 0; !with_shapes.empty() && k < effect.theta.size(); ++k)
      widen(effect.shape_intervals[k], with_shapes[i].shapes[k], 1, info.shape[k]);
  }
}

}  // namespace swarmcert::identification
