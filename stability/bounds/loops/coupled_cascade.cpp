#include "stability/bounds/loops/coupled_cascade.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <complex>

#include "nn/base/doubles.h"
#include "nn/base/pi.h"
#include "stability/gains_matrices.h"

namespace swarmcert::stability {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// int e enters as V' int e, where Ki = U V', so that an integral without effect leaves no pole at 0.
struct Integrals {
  MatrixXd to_command;   ///< U, [n x rank]
  MatrixXd from_errors;  ///< V', [rank x n]

  explicit Integrals(const MatrixXd& Ki) {
    const Eigen::JacobiSVD<MatrixXd> svd(Ki, Eigen::ComputeFullU | Eigen::ComputeFullV);
    constexpr double kNoGain = 1e-13;
    Index rank = 0;
    const VectorXd& sizes = svd.singularValues();
    while (rank < sizes.size() && sizes[rank] > kNoGain * sizes[0]) ++rank;
    to_command = svd.matrixU().leftCols(rank) * sizes.head(rank).asDiagonal();
    from_errors = svd.matrixV().leftCols(rank).transpose();
  }
};

/// Scales the coordinates by powers of two until rows and columns are of similar size (Parlett and Reinsch 1969):
/// exactly the same loop, but its eigenvalues are less sensitive to round-off.
VectorXd balance(MatrixXd& A) {
  const Index n = A.rows();
  VectorXd scale = VectorXd::Ones(n);
  for (bool changed = true; changed;) {
    changed = false;
    for (Index i = 0; i < n; ++i) {
      const double column = A.col(i).cwiseAbs().sum() - std::abs(A(i, i));
      const double row = A.row(i).cwiseAbs().sum() - std::abs(A(i, i));
      if (!(column > 0 && row > 0)) continue;
      const double factor = std::exp2(std::round(std::log2(row / column) / 2));
      if (!(column * factor + row / factor < 0.95 * (column + row))) continue;
      A.col(i) *= factor;
      A.row(i) /= factor;
      scale[i] *= factor;
      changed = true;
    }
  }
  return scale;
}

std::vector<Complex> eigenvalues(MatrixXd A) {
  balance(A);
  const Eigen::EigenSolver<MatrixXd> solver(A, false);
  return {solver.eigenvalues().begin(), solver.eigenvalues().end()};
}

bool is_left(const std::vector<Complex>& poles) {
  return std::all_of(poles.begin(), poles.end(), [](const Complex& pole) { return pole.real() < 0; });
}

/// x' = A x + B c, c = -C x. States of a channel: e, e'; with an attitude law the tilt times g, its derivative and, if
/// present, the measured derivative and the law's integral; last the output of the motors' lag.
class StateSpace {
 public:
  explicit StateSpace(const CoupledCascade& loop)
      : integrals_(loop.position.Ki), channels_(static_cast<Index>(loop.channels.size())) {
    Index size = 2 * channels_ + integrals_.from_errors.rows();
    for (const Cascade& channel : loop.channels) size += further_states(channel);
    A = MatrixXd::Zero(size, size);
    B = MatrixXd::Zero(size, channels_);
    C = MatrixXd::Zero(channels_, size);
    for (Index i = 0; i < channels_; ++i) A(i, channels_ + i) = 1;
    A.block(2 * channels_, 0, integrals_.from_errors.rows(), channels_) = integrals_.from_errors;
    Index next = 2 * channels_ + integrals_.from_errors.rows();
    for (Index i = 0; i < channels_; ++i)
      next = add_channel(loop.position, loop.channels[static_cast<std::size_t>(i)], i, next);
  }

  MatrixXd closed() const { return A - B * C; }

  MatrixXd A, B, C;

 private:
  static Index further_states(const Cascade& channel) {
    Index count = channel.lag_s > 0 ? 1 : 0;
    if (!channel.attitude) return count;
    return count + 2 + (channel.body_rate_lag_s > 0 ? 1 : 0) + (channel.attitude->KI_J_s3 > 0 ? 1 : 0);
  }

  /// @param next index of the first free state. @returns the index after the channel's states.
  Index add_channel(const PidMatrices& position, const Cascade& channel, Index i, Index next) {
    Eigen::RowVectorXd wanted = Eigen::RowVectorXd::Zero(A.cols());  // -u_i times the ratio
    wanted.head(channels_) = position.Kp.row(i);
    wanted.segment(channels_, channels_) = position.Kd.row(i);
    wanted.segment(2 * channels_, integrals_.to_command.cols()) = integrals_.to_command.row(i);
    wanted *= channel.ratio;
    Index driven = channels_ + i;  // state whose derivative is the output of the motors
    if (!channel.attitude) {
      C.row(i) = wanted;
    } else {
      const AttitudeLoop& law = *channel.attitude;
      const Index tilt = next++, rate = next++;
      A(driven, tilt) = 1;
      A(tilt, rate) = 1;
      driven = rate;
      Index measured = rate;
      if (channel.body_rate_lag_s > 0) {
        measured = next++;
        A(measured, rate) = 1 / channel.body_rate_lag_s;
        A(measured, measured) = -1 / channel.body_rate_lag_s;
      }
      Eigen::RowVectorXd error = wanted;  // of the tilt
      error[tilt] = 1;
      C.row(i) = law.KR_J_s2 * error;
      C(i, measured) += law.Kw_J_s;
      if (law.KI_J_s3 > 0) {
        const Index integral = next++;
        A.row(integral) = error;
        C(i, integral) += law.KI_J_s3;
      }
      C.row(i) *= channel.ratio;
    }
    if (!(channel.lag_s > 0)) {
      B(driven, i) = 1;
      return next;
    }
    const Index acts = next++;
    A(driven, acts) = 1;
    A(acts, acts) = -1 / channel.lag_s;
    B(acts, i) = 1 / channel.lag_s;
    return next;
  }

  Integrals integrals_;
  Index channels_;
};

CoupledCascade with_factor(CoupledCascade loop, double factor, std::size_t first, std::size_t count) {
  for (std::size_t i = first; i < first + count; ++i) loop.channels[i].ratio *= factor;
  return loop;
}

/// The loop opened at some commands: the transfer function from them to the law's response, C (s I - A)^-1 B.
class CutAt {
 public:
  /// @param first, count range of the opened commands; the others stay closed.
  CutAt(const StateSpace& whole, Index first, Index count) {
    const Index channels = whole.B.cols();
    A_ = whole.A;
    for (Index i = 0; i < channels; ++i)
      if (i < first || i >= first + count) A_ -= whole.B.col(i) * whole.C.row(i);
    const VectorXd scale = balance(A_);
    B_ = scale.cwiseInverse().asDiagonal() * whole.B.middleCols(first, count);
    C_ = whole.C.middleRows(first, count) * scale.asDiagonal();
    poles_ = eigenvalues(A_);
  }

  /// Returns the eigenvalues at s = j w, sorted by magnitude.
  std::vector<Complex> at(double w_rad_s) const {
    MatrixXcd resolvent = -A_.cast<Complex>();
    resolvent.diagonal().array() += Complex(0, w_rad_s);
    const MatrixXcd answer = C_ * resolvent.partialPivLu().solve(B_.cast<Complex>());
    const Eigen::ComplexEigenSolver<MatrixXcd> solver(answer, false);
    std::vector<Complex> result(solver.eigenvalues().begin(), solver.eigenvalues().end());
    std::sort(result.begin(), result.end(),
              [](const Complex& a, const Complex& b) { return std::abs(a) < std::abs(b); });
    return result;
  }

  /// Returns frequencies between which no eigenvalue's magnitude is expected to cross 1 twice: small steps from far
  /// below the slowest to beyond the fastest pole, refined across each resonance of the closed part.
  std::vector<double> grid(const std::vector<Complex>& closed_poles) const {
    constexpr double kBeyond = 1e3, kStep = 1.02;
    double slowest = kInfinity, fastest = 0;
    for (const Complex& pole : closed_poles) {
      slowest = std::min(slowest, std::abs(pole));
      fastest = std::max(fastest, std::abs(pole));
    }
    std::vector<double> result;
    for (double w = slowest / kBeyond; w < fastest * kBeyond; w *= kStep) result.push_back(w);
    for (const Complex& pole : poles_) {
      for (int k = -16; pole.imag() > 0 && k <= 16; ++k) {
        const double w = pole.imag() + k * std::abs(pole.real()) / 4;
        if (w > slowest / kBeyond) result.push_back(w);
      }
    }
    std::sort(result.begin(), result.end());
    return result;
  }

 private:
  MatrixXd A_, B_, C_;
  std::vector<Complex> poles_;
};

/// Returns the smallest delay of the opened commands for which some pole lies on the imaginary axis: there an
/// eigenvalue l of the open loop has l exp(-j w T) = -1, so |l| = 1 and T = arg(-l)/w.
double delay_margin(const CutAt& loop, const std::vector<Complex>& closed_poles) {
  double least_s = kInfinity;
  double from = 0;
  std::vector<Complex> before;
  for (const double to : loop.grid(closed_poles)) {
    const std::vector<Complex> now = loop.at(to);
    for (std::size_t k = 0; k < before.size(); ++k) {
      const bool was_below = std::abs(before[k]) < 1;
      if (was_below == (std::abs(now[k]) < 1)) continue;
      double low = from, high = to;
      for (int i = 0; i < 60; ++i) {
        const double middle = (low + high) / 2;
        ((std::abs(loop.at(middle)[k]) < 1) == was_below ? low : high) = middle;
      }
      double phase = std::arg(-loop.at(low)[k]);
      if (phase < 0) phase += 2 * kPi;
      least_s = std::min(least_s, phase / low);
    }
    from = to;
    before = now;
  }
  return least_s;
}

}  // namespace

PidMatrices pid_matrices(const CompositeGains& gains, double mass_kg) {
  const Eigen::Matrix3d Lambda = to_eigen(gains.Lambda_1_s), K = to_eigen(gains.K_kg_s) / mass_kg;
  return {Lambda * Lambda + 2 * K * Lambda, 2 * Lambda + K, K * Lambda * Lambda};
}

bool is_stable(const CoupledCascade& loop) { return is_left(eigenvalues(StateSpace(loop).closed())); }

CoupledMargins coupled_margins(const CoupledCascade& loop) {
  const std::size_t channels = loop.channels.size();
  CoupledMargins margins;
  margins.alone.resize(channels);
  const StateSpace whole(loop);
  const std::vector<Complex> poles = eigenvalues(whole.closed());
  if (!is_left(poles)) return margins;
  const auto set = [&](std::size_t first, std::size_t count, CascadeMargins& result) {
    set_gain_margins([&](double factor) { return is_stable(with_factor(loop, factor, first, count)); },
                     result);
    result.delay_s = delay_margin(CutAt(whole, static_cast<Index>(first), static_cast<Index>(count)), poles);
    set_damping(poles, result);
  };
  set(0, channels, margins.together);
  for (std::size_t i = 0; i < channels; ++i) set(i, 1, margins.alone[i]);
  return margins;
}

Nearness nearness_to_limit_cycle(const CoupledMargins& margins) {
  CascadeMargins least = margins.together;
  for (const CascadeMargins& alone : margins.alone) least.gain = std::min(least.gain, alone.gain);
  return nearness_to_limit_cycle(least);
}

}  // namespace swarmcert::stability
