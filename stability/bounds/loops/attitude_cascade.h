/// @file One axis of the position loop around the attitude loop that flies, as one linear loop.
///
/// Near hover a horizontal force needs a tilt: p'' = g theta + a. The attitude law turns the vehicle towards the tilt
/// that the position loop asks for, through motors with a first-order lag:
///   theta'' = L^-1 [-(Kw theta' + KR (theta - theta_c) + KI int (theta - theta_c))] / J + alpha,
///   g theta_c = -ratio (Kp e + Kd (e' + n) + Ki int e),  L = lag s + 1.
/// The law sees theta' behind a lag of its own: Kw theta' stands for Kw (rate_lag s + 1)^-1 theta'.
/// Lee's law has this form, with its feed-forward of the body rate left out; the robust law
/// tau = -K (omega - omega_r), omega_r = -Lambda theta, has it with Kw = K, KR = K Lambda.
#pragma once

#include <complex>
#include <functional>
#include <optional>
#include <vector>

#include "stability/bounds/loops/impulse_response.h"

namespace swarmcert::stability {

/// Gains of the attitude law over the moment of inertia about the axis of the tilt.
struct AttitudeLoop {
  double KR_J_s2 = 0;  ///< 1/s^2
  double Kw_J_s = 0;   ///< 1/s
  double KI_J_s3 = 0;  ///< 1/s^3
};

struct Cascade {
  double Kp = 0;     ///< 1/s^2
  double Kd = 0;     ///< 1/s
  double Ki = 0;     ///< 1/s^3, as it acts
  double ratio = 1;  ///< force, and torque, that acts per one commanded
  /// Nothing for the vertical axis, where thrust acts without a tilt.
  std::optional<AttitudeLoop> attitude;
  double lag_s = 0;            ///< of thrust and torque
  double body_rate_lag_s = 0;  ///< of the measured theta'; without attitude it has no effect
};

/// What disturbs the loop.
enum class CascadeInput {
  kAcceleration,         ///< a: force per mass, m/s^2
  kVelocityError,        ///< n: estimated minus true velocity, m/s
  kAngularAcceleration,  ///< alpha: torque per moment of inertia, rad/s^2; horizontal axes only
};

/// From `input` to e, the sign of the velocity error reversed. Common factors of s are cancelled, so it has none where
/// Ki = 0 or KI = 0.
/// @throws std::invalid_argument for an angular acceleration without an attitude loop.
TransferFunction cascade_transfer(const Cascade& loop, CascadeInput input);

bool is_stable(const Cascade& loop);

/// How far a loop is from oscillating. All zero where it is not stable.
struct CascadeMargins {
  double gain = 0;      ///< factor by which `ratio` can grow; infinite where none destabilises it
  double low_gain = 0;  ///< factor to which `ratio` can shrink; 0: to nothing
  double delay_s = 0;   ///< between the state and the motors, beside lag_s
  /// Of the pair of poles with the least damping: -Re/|s|, and |s| in rad/s. 1 and 0 where no pole oscillates.
  double damping = 0, frequency_rad_s = 0;
};
CascadeMargins cascade_margins(const Cascade& loop);

/// Sets `gain` and `low_gain` to the ends of the factors around 1, between 1e-4 and 1e4, for which the loop stays
/// stable. @param holds whether it is, for a factor of its gain; true for 1. It is asked in steps of 5 %: a range of
/// unstable factors that is narrower may be passed over.
void set_gain_margins(const std::function<bool(double factor)>& holds, CascadeMargins& margins);

/// Sets `damping` and `frequency_rad_s`.
void set_damping(const std::vector<std::complex<double>>& of_poles, CascadeMargins& margins);

enum class Nearness { kClear, kClose, kUnstable };
inline constexpr double kLeastGainMargin = 2, kLeastDamping = 0.05;

/// Close to a limit cycle: the gain can less than double (the textbook 6 dB), or an oscillation keeps nearly three
/// quarters of its size per cycle (damping below 0.05). Saturation, backlash and a lag that is larger than stated then
/// suffice to keep it alive.
Nearness nearness_to_limit_cycle(const CascadeMargins& margins);
/// "clear", "close to a limit cycle", "unstable".
const char* name(Nearness nearness);

}  // namespace swarmcert::stability
