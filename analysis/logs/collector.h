/// @file Collects the records of a file with a single clock into one topic of a RawLog.
#pragma once

#include "analysis/logs/recognition.h"
#include "analysis/logs/record_source.h"

namespace swarmcert::logs {

/// Returns the column whose name says that it is a clock; -1 without one.
int clock_by_name(const RawTopic& topic);

/// Returns the column that rises by nearly the same step with nearly every record, preferably by something other than
/// one per record; -1 without one.
int clock_by_steps(const RawTopic& topic);

/// Returns the seconds per unit of a clock, judged by its median step: the largest common unit that gives a plausible
/// logging rate.
double seconds_per_unit(std::vector<double> clock);

/// Log blocks of several rates, joined over time, leave blanks: columns of the last topic that have numbers in the same
/// records, in less than nine tenths of those that have a time, become a topic of these records only.
void separate_blocks(RawLog& log);

/// Reads a CSV file: one topic, or one for each block of columns.
/// @throws files::InputError as read_csv() does, and if no line can be read or no column can be the time
RawLog read_table(std::istream& in, const std::string& path, const SignalMap& map);

/// Collects records. The unit of the time column is decided at the end, from its steps.
class Collector : public RecordSink {
 public:
  /// @param log receives one topic. `log` and `map` must outlive this object.
  Collector(RawLog& log, const SignalMap& map) : log_(log), map_(map) {}

  /// @throws files::InputError if the map names no time.
  void begin(const std::vector<std::string>& names) override;
  void record(const std::vector<double>& values) override;
  bool needs(std::size_t column) const override { return needs_[column] != 0; }
  /// Call once after the last record: fills RawTopic::time_s.
  /// @throws files::InputError if no column can be the time.
  void end();

 private:
  [[noreturn]] void refuse_without_clock() const;

  RawLog& log_;
  const SignalMap& map_;
  std::vector<char> needs_;
  bool has_clock_ = false;  ///< by its name
  std::size_t time_ = 0;
  double scale_s_ = 0;  ///< seconds per unit of the time column; 0: decided from its steps
};

}  // namespace swarmcert::logs
