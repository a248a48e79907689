/// @file The Crazyflie firmware's battery compensation: duty of a motor from the thrust that is asked of it.
#pragma once

#include <algorithm>

namespace swarmcert::logs {

/// PWM = (-0.0006239 th^2 + 0.088 th) / V with th = 60 m/65536, the thrust in gram-force of four motors; the result as
/// a share of full duty.
/// @param requested m/65536
/// @param limited   at most full duty, as the firmware applies it
inline double compensated_duty(double requested, double battery_V, bool limited = true) {
  constexpr double kFull = 65535.0 / 65536.0;
  const double thrust_gf = 60 * std::max(requested, 0.0);
  const double duty = (-0.0006239 * thrust_gf * thrust_gf + 0.088 * thrust_gf) / battery_V * kFull;
  return limited ? std::clamp(duty, 0.0, kFull) : duty;
}

}  // namespace swarmcert::logs
