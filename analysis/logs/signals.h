/// @file Assignment of columns to signals, with units and frames.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "analysis/logs/log.h"

namespace swarmcert::files {
class Keys;
}

namespace swarmcert::logs {

/// The signals a column can carry. In a group, the enumerator is the first signal and the others follow it.
enum Signal : int {
  kTime = 0,                ///< us
  kPosition = 1,            ///< m, W
  kVelocity = 4,            ///< m/s, W
  kForceWorld = 7,          ///< specific force, m/s^2, W
  kForceBody = 10,          ///< the same in B
  kAccelerationWorld = 13,  ///< acceleration without gravity, m/s^2, W
  kAttitude = 16,           ///< x, y, z, w
  kPackedAttitude = 20,     ///< the firmware's 32-bit quaternion
  kRates = 21,              ///< rad/s, B
  kDuty = 24,
  kBattery = 28,  ///< V
  kTargetPosition = 29,
  kTargetVelocity = 32,
  kMotorForce = 35,  ///< N
  kThrust = 39,      ///< N
  kTorque = 40,      ///< N m
  kEuler = 43,  ///< roll, pitch, yaw in rad: R = Rz(yaw) Ry(pitch) Rx(roll); any of the three may be missing
  kRequested = 46,      ///< thrust requested of each motor before battery compensation, over its full scale
  kRotorSpeed = 50,     ///< of each rotor, in any unit
  kMotorCommand = 54,   ///< normalised command of each of up to eight motors, 0 .. 1
  kThrustCommand = 62,  ///< collective thrust in the controller's own unit
  kNumSignals = 63
};

/// A stored number less `offset`, times multiply / divide, is the signal in its own unit.
struct UnitFactor {
  double multiply = 1, divide = 1, offset = 0;

  double scale() const { return multiply / divide; }
};

struct SignalSource {
  int signal;
  std::string column;  ///< or "TOPIC: COLUMN"
  UnitFactor factor;
  std::string unit;   ///< of the column
  std::string why{};  ///< evidence, in words
};

/// The user's meaning of the columns. If empty, columns are recognised by name (dictionary.h) and evidence.
using SignalMap = std::vector<SignalSource>;

/// Returns the factor of `unit`, spelled as in columns.toml; nothing if `signal` has no such unit.
std::optional<UnitFactor> unit_factor(int signal, const std::string& unit);

/// Returns the name of one signal in columns.toml, "position_x"; empty if it has none.
std::string columns_name(int signal);

/// Returns whether both scales are the same.
bool is_same_scale(const UnitFactor& a, const UnitFactor& b);

/// Returns the unit of columns.toml that has this factor; empty if no unit has it.
std::string unit_of_factor(int signal, const UnitFactor& factor);

/// Returns whether both give the same columns the same signals and units.
bool is_same_meaning(const SignalMap& a, const SignalMap& b);

/// Describes columns.toml.
void describe_columns_file(files::Keys& keys);
/// Reads a columns.toml: one table per signal, `[position_x] column = "x_mm", unit = "mm", frame = "world"`.
/// @throws files::InputError with line, key and hint; misspelt signals, units and frames get a suggestion.
SignalMap read_columns(const std::string& path);
SignalMap parse_columns(const std::string& text, const std::string& path);

}  // namespace swarmcert::logs
