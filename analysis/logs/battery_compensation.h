/// @file The Crazyflie firmware's battery compensation: motor duty from requested thrust.
#pragma once

#include <algorithm>

namespace swarmcert::logs {

/// Returns PWM = (-0.0006239 th^2 + 0.088 th) / V as a fraction of full duty, where th = 60 m/65536 is the thrust of
/// all four motors in gram-force.
/// @param requested m/65536
/// @param limited   clamp to full duty, as the firmware does
inline double compensated_duty(double requested, double battery_V, bool limited = true) {
  constexpr double kFull = 65535.0 / 65536.0;
  const double thrust_gf = 60 * std::max(requested, 0.0);
  const double duty = (-0.0006239 * thrust_gf * thrust_gf + 0.088 * thrust_gf) / battery_V * kFull;
  return limited ? std::clamp(duty, 0.0, kFull) : duty;
}

}  // namespace swarmcert::logs
