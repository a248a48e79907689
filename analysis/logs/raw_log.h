/// @file A log file as stored in its format: topics with their own clocks, and parameters.
///
/// Readers of multi-topic formats fill it; columns are interpreted later, in one place for all formats.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "analysis/logs/log.h"

namespace swarmcert::logs {

/// A field of a topic. `values` has one entry per time of the topic; NaN where the file has none.
struct RawColumn {
  std::string name;  ///< as the file names it, arrays as `q[0]`, nested fields as `pose.position.x`
  std::vector<double> values;
};

/// A stream of records, e.g. a PX4 topic instance, a ROS topic, an event of a micro-SD log, a whole CSV file.
struct RawTopic {
  std::string name;
  std::string type;  ///< message type where the format has one, e.g. "geometry_msgs/msg/PoseStamped"
  int instance = 0;
  std::vector<double> time_s;  ///< on the file's clock, as stored: neither sorted nor repaired
  std::string clock{};         ///< the column that holds the times; empty: none does
  double clock_unit_s = 1;     ///< its unit
  std::vector<RawColumn> columns;

  /// Returns the column with this name; nullptr if there is none.
  const RawColumn* find(const std::string& column) const {
    for (const RawColumn& candidate : columns)
      if (candidate.name == column) return &candidate;
    return nullptr;
  }
};

struct RawLog {
  std::string path;
  std::string format;  ///< e.g. "ulog", "mcap", "rosbag2 sqlite", "ardupilot"
  std::vector<RawTopic> topics;
  /// Parameters of the vehicle at the start of the log, by their names in the file.
  std::map<std::string, double> parameters;
  std::vector<std::string> messages;  ///< that ArduPilot wrote while logging, e.g. "ArduCopter V4.5.1"
  std::vector<LeftOut> left_out;
  LogHealth health;
};

}  // namespace swarmcert::logs
