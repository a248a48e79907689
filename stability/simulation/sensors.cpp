#include "stability/simulation/sensors.h"

#include <algorithm>
#include <cmath>

#include "nn/base/pi.h"

namespace swarmcert::stability {
namespace {

constexpr double kMagnitude = 511;  ///< nine bits

}  // namespace

LowPass::LowPass(double cutoff_hz, double rate_hz) {
  const double k = std::tan(kPi * cutoff_hz / rate_hz);
  const double norm = 1 / (1 + std::sqrt(2.0) * k + k * k);
  b0_ = k * k * norm;
  b1_ = 2 * b0_;
  b2_ = b0_;
  a1_ = 2 * (k * k - 1) * norm;
  a2_ = (1 - std::sqrt(2.0) * k + k * k) * norm;
}

Eigen::Vector3d LowPass::filter(const Eigen::Vector3d& input) {
  if (!is_filled_) {
    x1_ = x2_ = y1_ = y2_ = input;
    is_filled_ = true;
  }
  const Eigen::Vector3d output = b0_ * input + b1_ * x1_ + b2_ * x2_ - a1_ * y1_ - a2_ * y2_;
  x2_ = x1_;
  x1_ = input;
  y2_ = y1_;
  y1_ = output;
  return output;
}

DelayedSignal::DelayedSignal(double delay_s, double gain, double period_s) : gain_(gain) {
  const double periods = delay_s / period_s;
  share_ = periods - std::floor(periods);
  past_.resize(static_cast<std::size_t>(std::floor(periods)) + 2);
}

Eigen::Vector3d DelayedSignal::filter(const Eigen::Vector3d& input) {
  if (gain_ == 0) return input;
  if (!is_filled_) {
    std::fill(past_.begin(), past_.end(), input);
    is_filled_ = true;
  }
  past_[next_] = input;
  next_ = (next_ + 1) % past_.size();  // now the oldest: floor(delay) + 1 periods old
  const Eigen::Vector3d& older = past_[next_];
  const Eigen::Vector3d& younger = past_[(next_ + 1) % past_.size()];
  return input + gain_ * (younger + share_ * (older - younger) - input);
}

std::uint32_t compress_quaternion(const Eigen::Quaterniond& quaternion) {
  const double* const q = quaternion.coeffs().data();
  unsigned largest = 0;
  for (unsigned i = 1; i < 4; ++i) {
    if (std::abs(q[i]) > std::abs(q[largest])) largest = i;
  }
  const bool negate = q[largest] < 0;
  std::uint32_t compressed = largest;
  for (unsigned i = 0; i < 4; ++i) {
    if (i == largest) continue;
    const std::uint32_t negative = (q[i] < 0) != negate ? 1 : 0;
    const double magnitude = std::min(kMagnitude * std::abs(q[i]) / std::sqrt(0.5) + 0.5, kMagnitude);
    compressed = compressed << 10 | negative << 9 | static_cast<std::uint32_t>(magnitude);
  }
  return compressed;
}

std::int16_t milli(double value) {
  const double scaled = std::trunc(value * 1000);
  if (!(std::abs(scaled) < 0x1p62)) return 0;  // NaN, or far beyond any log
  return static_cast<std::int16_t>(
      static_cast<std::uint16_t>(static_cast<std::uint64_t>(static_cast<std::int64_t>(scaled))));
}

}  // namespace swarmcert::stability
