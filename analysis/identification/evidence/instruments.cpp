#include "analysis/identification/evidence/instruments.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace swarmcert::evidence {
namespace {

constexpr double kLag_s = 0.07;
constexpr int kLags = 8;
/// Instruments from the columns along the set points: their strongest components along each axis.
constexpr Eigen::Index kMostComponents = 40;

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

/// Returns the strongest principal components of columns scaled to equal power, [rows x components].
Eigen::MatrixXf components(const Eigen::MatrixXf& columns, Eigen::Index most) {
  std::vector<Eigen::Index> used;
  for (Eigen::Index c = 0; c < columns.cols(); ++c) {
    if (columns.col(c).squaredNorm() > 0) used.push_back(c);
  }
  if (used.empty()) return Eigen::MatrixXf(columns.rows(), 0);
  Eigen::MatrixXf scaled = columns(Eigen::all, used);
  scaled.colwise().normalize();
  const Eigen::MatrixXf gram = scaled.transpose() * scaled;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXf> parts(gram);
  return scaled * parts.eigenvectors().rightCols(std::min<Eigen::Index>(most, gram.cols()));
}

}  // namespace

Instruments::Instruments(const Spectral& spectral, Eigen::Index columns)
    : spectral_(spectral), commanded_(Eigen::MatrixXf::Zero(spectral.rows(), 1 + 9 * (kLags + 1) + 3)) {
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
    Eigen::Index column = 0;
    put(Eigen::VectorXf::Ones(stretch.count), commanded_, column++);
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
    const Eigen::MatrixXf more = components(wanted_[axis], kMostComponents);
    result[axis].resize(commanded_.rows(), commanded_.cols() + more.cols());
    result[axis] << commanded_, more;
  }
  return result;
}

}  // namespace swarmcert::evidence
