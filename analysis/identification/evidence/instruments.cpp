#include "analysis/identification/evidence/instruments.h"

#include <algorithm>
#include <cmath>
#include <random>

namespace swarmcert::evidence {
namespace {

constexpr double kLag_s = 0.07;
constexpr int kLags = 8;
/// Instruments along each axis from the columns along the set points.
constexpr Eigen::Index kMixtures = 48;

/// Returns `series` delayed by a number of records, with its first value before its start.
Eigen::VectorXf delayed(const Eigen::Ref<const Eigen::VectorXf>& series, std::ptrdiff_t records) {
  Eigen::VectorXf result(series.size());
  for (Eigen::Index i = 0; i < series.size(); ++i) result[i] = series[std::max<Eigen::Index>(i - records, 0)];
  return result;
}

/// Returns position, velocity and acceleration of the set points, [records x 9].
Eigen::MatrixXf commanded_signals(const residuals::Track& track) {
  constexpr std::ptrdiff_t kHalf = 3;
  const auto n = static_cast<std::ptrdiff_t>(track.targets.size());
  Eigen::MatrixXf signals(n, 9);
  for (std::ptrdiff_t i = 0; i < n; ++i) {
    const auto before = static_cast<std::size_t>(std::max<std::ptrdiff_t>(i - kHalf, 0));
    const auto after = static_cast<std::size_t>(std::min(i + kHalf, n - 1));
    const stability::Setpoint& target = track.targets[static_cast<std::size_t>(i)];
    const double span_s = track.instants[after].time_s - track.instants[before].time_s;
    Eigen::Vector3d a = Eigen::Vector3d::Zero();
    if (span_s > 0) a = (track.targets[after].v_W_m_s - track.targets[before].v_W_m_s) / span_s;
    signals.row(i) << target.p_W_m.cast<float>().transpose(), target.v_W_m_s.cast<float>().transpose(),
        a.cast<float>().transpose();
  }
  return signals;
}

/// Returns mixtures with random weights of the columns scaled to equal power, [rows x mixtures]. Nearly always, they
/// span the strongest directions of the columns (Halko, Martinsson & Tropp 2011).
Eigen::MatrixXf mixtures(const Eigen::MatrixXf& columns) {
  std::mt19937_64 random(1);
  std::normal_distribution<float> normal;
  Eigen::MatrixXf weights =
      Eigen::MatrixXf::NullaryExpr(columns.cols(), kMixtures, [&] { return normal(random); });
  for (Eigen::Index c = 0; c < columns.cols(); ++c) {
    const float norm = columns.col(c).norm();
    weights.row(c) *= norm > 0 ? 1 / norm : 0;
  }
  return columns * weights;
}

}  // namespace

Instruments::Instruments(const Spectral& spectral, Eigen::Index columns, std::vector<std::string> vehicles)
    : spectral_(spectral), vehicles_(std::move(vehicles)) {
  const auto constants = static_cast<Eigen::Index>(vehicles_.size());
  commanded_.setZero(spectral.rows(), constants + 9 * (kLags + 1) + 3);
  for (Eigen::MatrixXf& axis : wanted_) axis.setZero(spectral.rows(), columns);
}

void Instruments::add(const identification::ModelledTrack& modelled, const std::vector<Stretch>& stretches,
                      std::size_t first, const std::array<Eigen::MatrixXf, 3>& wanted) {
  const residuals::Track& track = modelled.track;
  if (track.targets.size() != track.instants.size()) {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_complete_ = false;
    return;
  }
  const Eigen::MatrixXf commanded = commanded_signals(track);
  for (std::size_t s = 0; s < stretches.size(); ++s) {
    const Stretch& stretch = stretches[s];
    const auto put = [&](const Eigen::VectorXf& series, Eigen::MatrixXf& to, Eigen::Index column) {
      spectral_.transform(first + s, series.data(), to.col(column).data());
    };
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (Eigen::Index c = 0; c < wanted[axis].cols(); ++c)
        if (!wanted[axis].col(c).isZero())
          put(wanted[axis].col(c).segment(stretch.first, stretch.count), wanted_[axis], c);
    }
    const auto vehicle = std::find(vehicles_.begin(), vehicles_.end(), track.vehicle) - vehicles_.begin();
    put(Eigen::VectorXf::Ones(stretch.count), commanded_, vehicle);
    auto column = static_cast<Eigen::Index>(vehicles_.size());
    for (Eigen::Index signal = 0; signal < commanded.cols(); ++signal) {
      const Eigen::VectorXf series = commanded.col(signal).segment(stretch.first, stretch.count);
      for (int lag = 0; lag < kLags; ++lag)
        put(delayed(series, std::lround(lag * kLag_s / stretch.step_s)), commanded_, column++);
      const Eigen::VectorXf about = series.array() - series.mean();
      put(about.cwiseAbs2(), commanded_, column++);
      if (signal < 3) put(about.array().cube(), commanded_, column++);
    }
  }
}

std::array<Eigen::MatrixXf, 3> Instruments::of_axes() const {
  std::array<Eigen::MatrixXf, 3> result;
  if (!is_complete_) return result;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Eigen::MatrixXf more = mixtures(wanted_[axis]);
    result[axis].resize(commanded_.rows(), commanded_.cols() + more.cols());
    result[axis] << commanded_, more;
  }
  return result;
}

}  // namespace swarmcert::evidence
