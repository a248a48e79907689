#include "analysis/residuals/smoothing_window.h"

#include <cmath>

#include "nn/base/pi.h"

namespace swarmcert::residuals {
namespace {

constexpr int kCapacity = 256;

/// One number per record of a window, on the stack for speed: every record of every fit passes through here.
using WindowVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kCapacity, 1>;

/// Returns the weights whose product with values is the derivative of order `order` (1 or 2) of the least squares
/// polynomial of the same degree, computed from the orthogonal polynomials of the times.
WindowVector derivative_weights(const WindowVector& times_s, int order) {
  const WindowVector t = times_s.array() - times_s.mean();
  const double tt = t.squaredNorm();
  if (order == 1) return t / tt;
  const WindowVector square = t.cwiseAbs2();
  const WindowVector second = square.array() - square.mean() - t.array() * (square.dot(t) / tt);
  return 2 * second / second.dot(square);
}

}  // namespace

// Fourier transforms of 3/4 (1 - u^2) and 15/16 (1 - u^2)^2 on [-1, 1]: 3 j1(x) / x and 15 j2(x) / x^2.
double power_passed(logs::ForceSource source, double length_s, double frequency_hz) {
  constexpr double kSeries = 0.05;
  if (source != logs::ForceSource::kVelocity && source != logs::ForceSource::kPosition) return 1;
  const double x = kPi * frequency_hz * length_s;
  if (x < kSeries) return 1;
  const double s = std::sin(x), c = std::cos(x);
  const double mean = source == logs::ForceSource::kPosition
                          ? 15 * ((3 - x * x) * s - 3 * x * c) / (x * x * x * x * x)
                          : 3 * (s - x * c) / (x * x * x);
  return mean * mean;
}

SmoothingWindow::SmoothingWindow(logs::ForceSource source, double length_s, int channels)
    : order_(source == logs::ForceSource::kPosition ? 2 : 1),
      length_s_(length_s),
      last_(3, channels),
      once_(Eigen::Matrix3Xd::Zero(3, channels)),
      twice_(Eigen::Matrix3Xd::Zero(3, channels)) {}

void SmoothingWindow::restart() {
  has_past_ = false;
  times_s_.clear();
  first_ = 0;
  once_.setZero();
  twice_.setZero();
}

void SmoothingWindow::average(double time_s, Eigen::Ref<Eigen::Matrix3Xd> values) {
  if (has_past_) {
    const double h = time_s - last_s_;
    twice_ += h * once_ + h * h / 6 * (2 * last_ + values);
    once_ += h / 2 * (last_ + values);
  }
  has_past_ = true;
  last_s_ = time_s;
  last_ = values;
  if (order_ == 2)
    values = twice_;
  else
    values = once_;
  differentiate(time_s, values);
}

void SmoothingWindow::differentiate(double time_s, Eigen::Ref<Eigen::Matrix3Xd> values) {
  if (history_.size() == 0) history_.resize(values.size(), kCapacity);
  if (times_s_.size() == std::size_t{kCapacity}) {  // keep what the window still covers, at most half
    const std::size_t kept = std::min(std::size_t{kCapacity} / 2, times_s_.size() - first_);
    const auto columns = static_cast<Eigen::Index>(kept);
    history_.leftCols(columns) =
        history_.middleCols(static_cast<Eigen::Index>(times_s_.size() - kept), columns).eval();
    times_s_.erase(times_s_.begin(), times_s_.end() - static_cast<std::ptrdiff_t>(kept));
    first_ = 0;
  }
  Eigen::Map<Eigen::Matrix3Xd>(history_.col(static_cast<Eigen::Index>(times_s_.size())).data(), 3,
                               values.cols()) = values;
  times_s_.push_back(time_s);
  while (times_s_[first_] < time_s - length_s_) ++first_;
  const auto count = static_cast<Eigen::Index>(times_s_.size() - first_);
  if (count < order_ + 2) {
    values.setZero();
    return;
  }
  const WindowVector t =
      Eigen::Map<const Eigen::VectorXd>(times_s_.data() + first_, count).array() - times_s_[first_];
  const WindowVector weights = derivative_weights(t, order_);
  const auto window = history_.middleCols(static_cast<Eigen::Index>(first_), count);
  if (values.outerStride() == values.rows()) {
    Eigen::Map<Eigen::VectorXd>(values.data(), values.size()).noalias() = window * weights;
  } else {
    const Eigen::VectorXd mean = window * weights;
    values = Eigen::Map<const Eigen::Matrix3Xd>(mean.data(), 3, values.cols());
  }
}

}  // namespace swarmcert::residuals
