/// @file Which columns of a file carry which signal, in which unit and frame.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "analysis/logs/record_source.h"

namespace swarmcert::logs {

/// The signals a column can carry. X stands for the first of a group whose others follow.
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
  kNumSignals = 43
};

/// `signal` = value of `column` * multiply / divide.
struct SignalSource {
  int signal;
  std::string column;
  double multiply = 1, divide = 1;
  bool is_certain = false;  ///< a user says that it is there
};

/// A map of columns; where two sources give one signal, the first that the file has is taken.
using SignalMap = std::vector<SignalSource>;

/// The names that the firmware's logs and the authors' CSV use. A value in this CSV's "time[ms]" is microseconds.
const SignalMap& known_columns();

/// columns.toml: one table per signal, `[position_x] column = "x_mm", unit = "mm", frame = "world"`.
/// @throws files::InputError with line, key and mend; signals, units and frames get a did-you-mean.
SignalMap read_columns(const std::string& path);
SignalMap parse_columns(const std::string& text, const std::string& path);

/// Turns records into samples: maps columns, drops what is not finite or not in time, and counts that.
/// A time must be later than the last one; one that is over ten seconds later counts only if the next record follows
/// it. The 32-bit tick may wrap.
class SampleBuilder : public RecordSink {
 public:
  /// @param log receives samples, signals and counts. @param map and `log` must outlive this.
  SampleBuilder(Log& log, const SignalMap& map);
  ~SampleBuilder() override;

  /// @throws files::InputError if a signal that every log needs (time, position, velocity) has no column, or a column
  /// that a columns.toml names is missing.
  void begin(const std::vector<std::string>& names) override;
  void record(const std::vector<double>& raw) override;
  bool needs(std::size_t column) const override;
  /// Call once after the last record.
  void end();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace swarmcert::logs
