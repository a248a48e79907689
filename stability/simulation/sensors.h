/// @file Sensors and logger of the published vehicles.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

namespace swarmcert::stability {

/// Second-order Butterworth low-pass, discretised by the bilinear transform with exact cutoff: the accelerometer's
/// filter (30 Hz, group delay 7.5 ms at low frequency).
class LowPass {
 public:
  /// Precondition: 0 < cutoff_hz < rate_hz / 2.
  LowPass(double cutoff_hz, double rate_hz);
  /// Filters one sample. The first sample initialises the state, so that there is no transient at the start.
  Eigen::Vector3d filter(const Eigen::Vector3d& input);

 private:
  double b0_, b1_, b2_, a1_, a2_;
  bool is_filled_ = false;
  Eigen::Vector3d x1_, x2_, y1_, y2_;
};

/// A signal u sampled at a fixed rate and partly delayed: u + gain (u(t - delay) - u), interpolated linearly between
/// samples and constant before the first.
class DelayedSignal {
 public:
  DelayedSignal(double delay_s, double gain, double period_s);
  Eigen::Vector3d filter(const Eigen::Vector3d& input);

 private:
  double gain_, share_;  ///< share_: weight of the older of the two samples around t - delay
  std::vector<Eigen::Vector3d> past_;
  std::size_t next_ = 0;
  bool is_filled_ = false;
};

/// Packs a unit quaternion into 32 bits like the firmware's log: order x, y, z, w; two bits for the index of the
/// largest component, which is made positive and omitted; then, for each of the others in ascending order from the
/// highest bits, a sign and nine bits of magnitude / sqrt(1/2).
std::uint32_t compress_quaternion(const Eigen::Quaterniond& q);

/// Returns value x 1000 as the firmware's int16: truncated towards zero, with int16 wrap-around.
std::int16_t milli(double value);

}  // namespace swarmcert::stability
