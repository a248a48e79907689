#include "analysis/identification/whitening.h"

#include <algorithm>
#include <cmath>

#include "nn/base/pi.h"

namespace swarmcert::identification {

void Autocovariance::add(const std::vector<double>& values, const std::vector<char>& restarts,
                         std::size_t step) {
  std::size_t begin = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (restarts[i] != 0) begin = i;
    for (std::size_t k = 0; k < 3 && begin + k * step <= i; ++k) {
      sums[k] += values[i] * values[i - k * step];
      counts[k] += 1;
    }
  }
}

Noise Autocovariance::noise() const {
  constexpr double kLeast = 0.1, kShortest = 0.1, kLongest = 0.99;  // correlations after kStep_s
  constexpr double kLeastWhite = 0.01;
  if (counts[2] < 1) return {};
  const double c[3] = {sums[0] / counts[0], sums[1] / counts[1], sums[2] / counts[2]};
  if (!(c[1] > kLeast * c[0]) || !(c[2] > 0)) return {};
  const double left = std::clamp(c[2] / c[1], kShortest, kLongest);
  const double gusts = std::min(c[1] / left, c[0]);
  return {-kStep_s / std::log(left), std::max(c[0] / gusts - 1, kLeastWhite)};
}

/// Computes the moving-average coefficient: the autocovariances of r_t - phi r_(t-1) are s (1 - phi^2) + n (1 + phi^2)
/// and -phi n for gusts of variance s and white noise of variance n; theta + 1/theta is their ratio.
void Whitening::tune(double dt_s) {
  if (dt_s == dt_s_) return;
  dt_s_ = dt_s;
  phi_ = std::exp(-dt_s / noise_.forget_s);
  const double n = noise_.white_share;
  const double half = 0.5 * ((1 - phi_ * phi_) + n * (1 + phi_ * phi_)) / (phi_ * n);
  theta_ = half - std::sqrt(half * half - 1);
}

const Eigen::Matrix3Xd& Notch::advance(const Eigen::Matrix3Xd& x, double dt_s, bool restart) {
  constexpr double kWidth_hz = 1;
  if (restart || x_[0].cols() != x.cols()) {
    // The filter nearly passes constants, so the state is that after a long time of x.
    for (int i = 0; i < 2; ++i) x_[i] = y_[i] = x;
    return out_ = x;
  }
  const double zero = 2 * std::cos(2 * kPi * frequency_hz_ * dt_s), pole = std::exp(-kPi * kWidth_hz * dt_s);
  out_ = x - zero * x_[0] + x_[1] + pole * zero * y_[0] - pole * pole * y_[1];
  x_[1].swap(x_[0]);
  x_[0] = x;
  y_[1].swap(y_[0]);
  y_[0] = out_;
  return out_;
}

const Eigen::Matrix3Xd& Whitening::advance(const Eigen::Matrix3Xd& sample, double dt_s, bool restart) {
  const Eigen::Matrix3Xd& x = noise_.line_hz > 0 ? notch_.advance(sample, dt_s, restart) : sample;
  if (!(noise_.forget_s > 0)) return x;
  if (restart || last_.cols() != x.cols()) {
    innovation_ = Eigen::Matrix3Xd::Zero(3, x.cols());
  } else {
    tune(dt_s);
    innovation_ = x - phi_ * last_ + theta_ * innovation_;
  }
  last_ = x;
  return innovation_;
}

}  // namespace swarmcert::identification
