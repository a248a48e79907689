/// @file From columns to signals: units, frames and signs that names do not settle are decided from the data, and
/// signals that nobody logged are derived from others.
#pragma once

#include <string>

#include "analysis/logs/log.h"
#include "analysis/logs/signal_table.h"

namespace swarmcert::logs {

/// A log on its way from columns to samples. The stages below are called in their order; each notes what it decided
/// in Log::interpretation and where signals come from in Log::sources.
struct Draft {
  const RawLog& raw;
  Recognition recognition;
  SignalTable table;
  Log& log;
  /// Acceleration in W without gravity, smoothed; empty where neither velocity nor position carries the axis.
  std::array<std::vector<double>, 3> acceleration_m_s2;
  bool asks_physics = true;             ///< false where a columns.toml says what columns are
  bool has_forward_right_down = false;  ///< the body's axes are those: the quaternion is still to be turned

  bool is_measured(int signal) const { return recognition.find(signal) != nullptr; }
  void note(const std::string& words) const { log.interpretation.push_back(words); }
  void add(const std::string& name, SignalInfo::Source source, const std::string& from,
           const std::string& unit, double noise = std::numeric_limits<double>::quiet_NaN()) const;
  /// Adds a group that columns carry.
  void add_measured(const std::string& name, int signal) const;
};

/// Velocity where only a position is logged; the smoothed acceleration, and its noise.
void derive_kinematics(Draft& draft);

/// Attitude: packed or plain quaternions, else Euler angles with the signs that fit the lateral acceleration, else the
/// thrust axis along acceleration + g and the yaw where there is one. Then the unit of the rates.
void settle_attitude(Draft& draft);

/// Specific force in W: accelerometer (unit, frame and gravity decided from the data), else from the acceleration.
void settle_specific_force(Draft& draft);

/// Duty, battery and total thrust.
void settle_thrust(Draft& draft);

/// Which axes can be judged, and what is missing for the others.
void settle_judgement(Draft& draft);

/// Delays between columns that show the same movement.
void estimate_delays(Draft& draft);

/// The log that `raw` holds.
/// @throws files::InputError if it has no time, or nothing that shows a movement; or if `map` names a missing column.
Log interpret(RawLog raw, const SignalMap& map);

}  // namespace swarmcert::logs
