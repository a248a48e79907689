/// @file One axis of the position loop and the attitude loop inside it, as one linear loop.
///
/// Near hover a horizontal force requires a tilt: p'' = g theta + a. The attitude law turns the vehicle towards the
/// tilt that the position loop commands, through motors with a first-order lag:
///   theta'' = L^-1 [-(Kw theta' + KR (theta - theta_c) + KI int (theta - theta_c))] / J + alpha,
///   g theta_c = -ratio (Kp e + Kd (e' + n) + Ki int e),  L = lag s + 1.
/// The law measures theta' behind a separate lag: Kw theta' stands for Kw (rate_lag s + 1)^-1 theta'. Lee's law has
/// this form if its feedforward of the body rate is omitted; the robust law
/// tau = J omega_r' - K (omega - omega_r), omega_r = -Lambda theta, has it with Kw = K + J Lambda, KR = K Lambda.
#pragma once

#include <complex>
#include <functional>
#include <optional>
#include <vector>

#include "stability/bounds/loops/impulse_response.h"

namespace swarmcert::stability {

/// Gains of the attitude law divided by the moment of inertia about the tilt axis.
struct AttitudeLoop {
  double KR_J_s2 = 0;  ///< 1/s^2
  double Kw_J_s = 0;   ///< 1/s
  double KI_J_s3 = 0;  ///< 1/s^3
};

struct Cascade {
  double Kp = 0;     ///< 1/s^2
  double Kd = 0;     ///< 1/s
  double Ki = 0;     ///< 1/s^3, effective
  double ratio = 1;  ///< actual force (and torque) per commanded one
  /// Empty for the vertical axis, where thrust acts without a tilt.
  std::optional<AttitudeLoop> attitude;
  double lag_s = 0;            ///< of thrust and torque
  double body_rate_lag_s = 0;  ///< of the measured theta'; no effect without attitude
};

/// Disturbance inputs of the loop.
enum class CascadeInput {
  kAcceleration,         ///< a: force per mass, m/s^2
  kVelocityError,        ///< n: estimated minus true velocity, m/s
  kAngularAcceleration,  ///< alpha: torque per moment of inertia, rad/s^2; horizontal axes only
};

/// Returns the transfer function from `input` to e, with reversed sign for the velocity error. Common factors of s are
/// cancelled, so it has none if Ki = 0 or KI = 0.
/// @throws std::invalid_argument for an angular acceleration without an attitude loop.
TransferFunction cascade_transfer(const Cascade& loop, CascadeInput input);

bool is_stable(const Cascade& loop);

/// Stability margins of a loop. All zero if it is unstable.
struct CascadeMargins {
  double gain = 0;      ///< factor by which `ratio` can grow; infinite if none destabilises the loop
  double low_gain = 0;  ///< factor to which `ratio` can shrink; 0: any
  double delay_s = 0;   ///< tolerated between the state and the motors, in addition to lag_s
  /// The damping ratio -Re/|s| and |s| in rad/s of the least damped pair of poles; 1 and 0 if no pole oscillates.
  double damping = 0, frequency_rad_s = 0;
};
CascadeMargins cascade_margins(const Cascade& loop);

/// Sets `gain` and `low_gain` to the ends of the range of gain factors around 1, between 1e-4 and 1e4, for which the
/// loop stays stable.
/// @param holds whether the loop is stable with its gain multiplied by a factor; true for 1. It is evaluated in steps
///     of 5 %; a narrower range of unstable factors may be missed.
void set_gain_margins(const std::function<bool(double factor)>& holds, CascadeMargins& margins);

/// Sets `damping` and `frequency_rad_s`.
void set_damping(const std::vector<std::complex<double>>& of_poles, CascadeMargins& margins);

enum class Nearness { kClear, kClose, kUnstable };
inline constexpr double kLeastGainMargin = 2, kLeastDamping = 0.05;

/// Classifies a loop as close to a limit cycle if its gain margin is below a factor of 2 (the textbook 6 dB), or if an
/// oscillation keeps nearly three quarters of its amplitude per cycle (damping below 0.05). Saturation, backlash or a
/// lag larger than stated may then sustain the oscillation.
Nearness nearness_to_limit_cycle(const CascadeMargins& margins);
/// Returns "clear", "close to a limit cycle" or "unstable".
const char* name(Nearness nearness);

}  // namespace swarmcert::stability
