/// @file Sensors and logger of the published vehicles.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

namespace swarmcert::stability {

/// Second-order Butterworth low-pass, bilinear transform with the cutoff kept exact: the accelerometer's filter
/// (30 Hz, group delay 7.5 ms at low frequency).
class LowPass {
 public:
  /// Precondition: 0 < cutoff_hz < rate_hz / 2.
  LowPass(double cutoff_hz, double rate_hz);
  /// The first value fills the filter, so that it starts without transient.
  Eigen::Vector3d filter(const Eigen::Vector3d& input);

 private:
  double b0_, b1_, b2_, a1_, a2_;
  bool is_filled_ = false;
  Eigen::Vector3d x1_, x2_, y1_, y2_;
};

/// A signal u sampled at a fixed rate, partly delayed: u + gain (u(t - delay) - u), linear between samples, and before
/// the first one as that one.
class DelayedSignal {
 public:
  DelayedSignal(double delay_s, double gain, double period_s);
  Eigen::Vector3d filter(const Eigen::Vector3d& input);

 private:
  double gain_, share_;  ///< share_: of the older one of the two samples around t - delay
  std::vector<Eigen::Vector3d> past_;
  std::size_t next_ = 0;
  bool is_filled_ = false;
};

/// A unit quaternion in 32 bits, as firmware logs it: in the order x, y, z, w, two bits for the index of the
/// largest component, which is made positive and left out; then sign and nine bits of magnitude / sqrt(1/2) for each
/// of the others, in ascending order from the highest bits.
std::uint32_t compress_quaternion(const Eigen::Quaterniond& q);

/// value x 1000 as the firmware's int16: truncated towards zero; wraps where int16 does.
std::int16_t milli(double value);

}  // namespace swarmcert::stability
