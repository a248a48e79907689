/// @file Interprets columns as signals.
///
/// Units, frames and signs that names leave open are decided from the data; signals that were not logged are derived
/// from others.
#pragma once

#include <string>

#include "analysis/logs/log.h"
#include "analysis/logs/signal_table.h"

namespace swarmcert::logs {

/// A log between columns and samples. The stages below are called in this order; each notes its decisions in
/// Log::interpretation and the origin of the signals in Log::sources.
struct Draft {
  const RawLog& raw;
  Recognition recognition;
  SignalTable table;
  Log& log;
  /// Smoothed acceleration in W without gravity; empty for an axis that has neither velocity nor position.
  std::array<std::vector<double>, 3> acceleration_m_s2;
  bool asks_physics = true;  ///< decide from the data; false if a columns.toml states the meaning

  bool is_measured(int signal) const { return recognition.find(signal) != nullptr; }
  void note(const std::string& words) const { log.interpretation.push_back(words); }
  void add(const std::string& name, SignalInfo::Source source, const std::string& from,
           const std::string& unit, double noise = std::numeric_limits<double>::quiet_NaN()) const;
  /// Adds a group of signals that columns carry.
  void add_measured(const std::string& name, int signal) const;
  void add_measured_or_missing(const std::string& name, int signal, bool is_there) const;
};

/// Derives the velocity if only a position is logged, and the smoothed acceleration with its noise.
void derive_kinematics(Draft& draft);

/// Determines the attitude: from packed or plain quaternions, else from Euler angles with the signs that fit the
/// lateral acceleration, else from the thrust axis along acceleration + g and the yaw if available. Then decides the
/// unit of the rates.
void settle_attitude(Draft& draft);

/// Determines the specific force in W: from the accelerometer (unit, frame and gravity are decided from the data), else
/// from the acceleration.
void settle_specific_force(Draft& draft);

/// Determines duty, battery voltage and total thrust.
void settle_thrust(Draft& draft);

/// Determines the axes along which a force can be judged, and what is missing for the others.
void settle_judgement(Draft& draft);

/// Estimates the delays between columns that show the same motion.
void estimate_delays(Draft& draft);

/// Interprets `raw` as a log.
/// @param meaning receives what was taken for what; also if nothing shows a motion
/// @throws files::InputError if it has no time or nothing that shows motion, or if `map` names a missing column.
Log interpret(RawLog raw, const SignalMap& map, SignalMap* meaning = nullptr);

}  // namespace swarmcert::logs
