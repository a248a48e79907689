/// @file gains.toml: position gains as flown, the rates of the loop, and its lags.
#pragma once

#include <array>
#include <limits>
#include <optional>
#include <string>

#include "controller/flight_controller.h"

namespace swarmcert::files {
class Keys;
}

namespace swarmcert::stability {

/// One number per world axis x, y, z.
using PerAxis = std::array<double, 3>;
/// A 3x3 matrix; m[i][j] is the entry in row i and column j.
using Matrix3 = controller::Matrix3<double>;
using PidGains = controller::PidGains<double>;
using CompositeGains = controller::CompositeGains<double>;
using controller::AttitudeLaw;

/// Gains of the attitude law about the body axes: torque = -(KR e_R + Kw e_w + KI int e_R). The robust law without its
/// integral has this form with Kw = K + J Lambda, KR = K Lambda.
struct AttitudeGains {
  PerAxis KR_Nm;
  PerAxis Kw_Nm_s;
  PerAxis KI_Nm_per_s;
};

/// The contents of gains.toml. Exactly one of `pid` and `composite` is present.
struct Gains {
  std::string path;    ///< path of the file, for messages and hashes
  std::string sha256;  ///< of its text
  std::optional<PidGains> pid;
  std::optional<CompositeGains> composite;
  /// Largest |int e dt| that the integrator keeps, in m s; infinite if the file sets no limit.
  PerAxis integrator_limit_m_s = {std::numeric_limits<double>::infinity(),
                                  std::numeric_limits<double>::infinity(),
                                  std::numeric_limits<double>::infinity()};
  double rate_hz = 0;            ///< of the position loop; 0: the law is analysed in continuous time only
  double integrator_step_s = 0;  ///< added per cycle: I += step * e; 1/rate_hz unless the file says otherwise
  AttitudeLaw attitude_law = AttitudeLaw::kLee;
  std::optional<AttitudeGains> attitude;  ///< for the margins of the cascade; simulation has its own
  double motor_lag_s = 0;                 ///< time constant of thrust, all axes
  double attitude_lag_s = 0;              ///< time constant of the thrust's direction: x and y only
  double body_rate_lag_s = 0;             ///< time constant of the measured body rates, in the cascade
  double delay_s = 0;                     ///< from state to force
  double network_rate_hz = 0;             ///< of the learned force, held between updates; 0: continuous
  double network_latency_s = 0;           ///< age of the network's inputs when its output is applied
};

/// Describes gains.toml.
void describe_gains_file(files::Keys& keys);

/// Reads gains.toml. Does not check whether Lambda and K satisfy the theorem's hypotheses.
/// @throws files::InputError with line, key, value and hint: unknown keys, both forms or neither, negative or
///     non-finite numbers, times above one second, rates outside 1 Hz .. 100 kHz, gains too large for any vehicle (Kp
///     above 1e7 1/s^2, ...), an integrator step without a rate.
Gains load_gains(const std::string& path);

/// Like load_gains(), but parses `text`; `path` is used in messages only.
Gains parse_gains(const std::string& text, const std::string& path);

}  // namespace swarmcert::stability
