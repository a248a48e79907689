/// @file The flight log of one vehicle in SI units, independent of the file format.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <string>
#include <vector>

namespace swarmcert::logs {

using Vector = std::array<double, 3>;

inline double norm(const Vector& v) { return std::hypot(v[0], v[1], v[2]); }

/// Standard gravity as rounded in the authors' code, m/s^2; also used to convert newton to gram-force.
inline constexpr double kGravity_m_s2 = 9.81;

/// Records further apart than this are not neighbours in time: filters restart and nothing is interpolated between
/// them. In logs slower than 50 Hz the limit is two and a half steps instead.
inline constexpr double kLongestGap_s = 0.030;

/// A unit quaternion that rotates B into W. As four numbers its order is always that of xyzw(), which is also the order
/// of Eigen::Quaterniond::coeffs() and of the simulated state.
struct Attitude {
  double x = 0, y = 0, z = 0, w = 1;

  std::array<double, 4> xyzw() const { return {x, y, z, w}; }
  /// Returns the rotation matrix by rows.
  std::array<Vector, 3> rotation() const;
};

/// One record. Frames: W is the world with z up; B is the body with x forward, y left, z up.
struct Sample {
  double time_us = 0;     ///< on the vehicle's own clock, which starts with the log; strictly increasing
  Vector position_m{};    ///< W
  Vector velocity_m_s{};  ///< W
  Vector specific_force_m_s2{};  ///< W; what an accelerometer measures: +9.81 in z at rest
  Attitude attitude;
  Vector rates_rad_s{};          ///< B
  std::array<double, 4> duty{};  ///< PWM/65536 per motor, in [0, 1]
  double battery_V = 0;
  Vector target_position_m{}, target_velocity_m_s{};  ///< W; NaN if the log has none
  std::array<double, 4> motor_force_N{};              ///< commanded by the controller, unsaturated
  double thrust_command_N = 0;
  Vector torque_command_Nm{};  ///< B
  /// Total thrust if it does not come from the duties; Signals::thrust states its unit.
  double given_thrust = 0;
  /// Normalised command of each of Signals::motor_commands motors, 0 .. 1.
  std::array<float, 8> motor_command{};
  bool restarts = false;  ///< first record, or more than kLongestGap_s after the previous one
};

/// Source of the total thrust of a log.
enum class ThrustSource {
  kNone,
  kDuty,          ///< Sample::duty and battery_V, through the model's thrust map
  kForce,         ///< Sample::given_thrust is the commanded force in newton
  kHoverMultiple  ///< Sample::given_thrust is in multiples of the hover thrust of this log
};

/// Source of the specific force of a log.
enum class ForceSource {
  kNone,
  kAccelerometer,  ///< measured
  kVelocity,       ///< slope of the velocity over a window
  kPosition        ///< curvature of the position over a window
};

/// Whether the vehicle reports that it was armed.
enum class Armed { kUnknown, kNever, kYes };

/// How the torques of a log can be used.
enum class TorqueUse {
  kNone,
  kMean,    ///< only their mean in slow flight, where it should vanish
  kDynamic  ///< at each instant
};

/// Which optional groups of signals a log has.
struct Signals {
  bool force = false;          ///< a force residual can be formed along at least one axis
  std::string force_lacks;     ///< the signals missing for that, in words; empty if `force`
  std::string not_multirotor;  ///< what the vehicle is if the log says that it is none, e.g. "fixed wing"
  std::array<bool, 3> force_axes{};  ///< axes of W along which a force can be judged
  ThrustSource thrust = ThrustSource::kNone;
  int motor_commands = 0;  ///< motors whose normalised commands gave `thrust`; 0: it has another source
  ForceSource specific_force = ForceSource::kNone;
  TorqueUse torque = TorqueUse::kNone;
  bool rotor_speeds = false;  ///< of each of four rotors
  bool position = false;      ///< all three axes
  bool attitude = false;      ///< measured; otherwise the thrust axis follows from the acceleration
  bool targets = false;       ///< target position and velocity
  bool commands = false;      ///< motor forces, thrust and torque commands
  bool rates = false;
};

/// What was repaired without loss.
struct Repaired {
  std::size_t unsorted_rows = 0;     ///< sorted by time
  std::size_t repeated_rows = 0;     ///< same time and values as another one, which is kept
  std::size_t unwrapped_clocks = 0;  ///< wraps of a counter or a time of day
  std::size_t merged_blocks = 0;     ///< log blocks of other rates than that of the records
  std::size_t journal_pages = 0;     ///< that a recorder left in the journal of its database (-wal)
};

/// Damage found in a file and how it was handled; nothing is repaired silently.
struct LogHealth {
  std::size_t blocks = 0;          ///< valid checksummed blocks (old binary format only)
  std::size_t damaged_blocks = 0;  ///< places where a checksum failed or no valid data could be read
  std::size_t skipped_bytes = 0;   ///< at these places, and after the last whole record
  bool truncated = false;          ///< the file ends inside a block, a record or a line
  bool checksum_failed = false;    ///< of the whole file (binary versions 1 and 2 only); records are kept
  std::size_t records = 0;         ///< records kept
  std::size_t damaged_lines = 0;   ///< CSV lines that do not have one number per column of the header
  std::size_t not_finite = 0;      ///< records dropped because a needed value is NaN or infinite
  std::size_t clock_jumps = 0;     ///< records dropped because their time does not follow the previous one
  std::size_t gaps = 0;            ///< pauses longer than kLongestGap_s
  double longest_gap_s = 0;
  double dropouts_s = 0;  ///< pauses during which the vehicle reports that it could not write
  std::size_t bytes = 0;  ///< of the file; 0: unknown
  Repaired repaired;
};

/// Something in a file that its reader did not pass on.
struct LeftOut {
  std::string name;         ///< of the topic, message or field
  std::string why;          ///< e.g. "its format is not defined in the file"
  std::size_t records = 0;  ///< number of records left out; 0: a part of each
};

/// How a log provides one signal.
struct SignalInfo {
  enum class Source { kMeasured, kDerived, kMissing };
  std::string name;  ///< "velocity", "specific_force", ...
  Source source = Source::kMissing;
  std::string from;    ///< columns, or how it is derived
  std::string unit;    ///< of the stored columns; of the derived signal
  double rate_hz = 0;  ///< of the records that contain it
  /// Standard deviation, in SI units; NaN: not estimated.
  double noise = std::numeric_limits<double>::quiet_NaN();
  /// Evidence, in bits, for what the columns were taken as, over `runner_up`; NaN: their names are known.
  double odds_bits = std::numeric_limits<double>::quiet_NaN();
  std::string runner_up{};
};

/// An event in a log.
struct LogEvent {
  std::string kind;  ///< impact, dropout, wrap, saturation, limit cycle
  double time_s = 0, duration_s = 0;
  std::string what;
};

/// The delay of one signal relative to another that shows the same motion.
struct SignalDelay {
  std::string signal, against;
  double delay_s = 0;  ///< positive: `signal` lags
  double correlation = 0;
};

struct Log {
  std::string path;
  std::string format;  ///< "usd", "usd version 1", "usd version 2", "csv", "ulog", ...
  Signals signals;
  std::vector<SignalInfo> sources;  ///< of all known signals, including missing ones
  std::vector<SignalDelay> delays;
  std::vector<LogEvent> events;  ///< of single columns: wraps and saturation of integers
  /// What was decided from the data rather than from names, and why.
  std::vector<std::string> interpretation;
  /// Mean command of a motor while it carries the weight, if Signals::thrust is kHoverMultiple; 0: none ran; else NaN.
  double hover_command = std::numeric_limits<double>::quiet_NaN();
  /// Motor thrust is proportional to this power of the command, 1 or 2; used if Signals::motor_commands is not 0.
  int motor_power = 1;
  /// Parameters of the vehicle at the start of the log, by their names in the file.
  std::map<std::string, double> parameters;
  double window_s = 0;  ///< of the derivative behind a derived specific force
  Armed armed = Armed::kUnknown;
  double epoch_s = 0;  ///< plus Sample::time_us is the time since 1970; 0: unknown
  LogHealth health;
  std::vector<LeftOut> left_out;
  std::vector<std::string> channels;  ///< as the file names them
  std::vector<Sample> samples;
};

}  // namespace swarmcert::logs
