/// @file A log file as its format stores it: topics with clocks of their own, and parameters. Readers of formats with
/// several topics fill this; what the columns mean is decided afterwards, in one place for all formats.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "analysis/logs/log.h"

namespace swarmcert::logs {

/// One field of a topic. `values` has one entry per time of its topic; NaN where the file has none.
struct RawColumn {
  std::string name;  ///< as the file names it, arrays as `q[0]`, nested fields as `pose.position.x`
  std::string unit;  ///< as the file states it; empty: it does not
  std::vector<double> values;
};

/// One stream of records, e.g. a PX4 topic instance, a ROS topic, an event of a micro-SD log, a whole CSV file.
struct RawTopic {
  std::string name;
  std::string type;  ///< message type where the format has one, e.g. "geometry_msgs/msg/PoseStamped"
  int instance = 0;
  std::vector<double> time_s;  ///< on the file's clock, as stored: neither sorted nor repaired
  std::vector<RawColumn> columns;
  std::map<std::string, std::string> texts;  ///< text fields: the first text that is not empty

  /// The column of that name; nullptr if there is none.
  const RawColumn* find(const std::string& column) const {
    for (const RawColumn& candidate : columns)
      if (candidate.name == column) return &candidate;
    return nullptr;
  }
};

/// A line that the vehicle wrote while it logged, e.g. "Takeoff detected".
struct RawMessage {
  double time_s = 0;
  int level = 0;  ///< as the format states it; syslog's levels in ULog and MAVLink: 0 emergency ... 7 debug
  std::string text;
};

/// A pause in which the vehicle could not write and says so.
struct RawDropout {
  double time_s = 0;  ///< of the last record before it
  double duration_s = 0;
};

/// A parameter that was set while the log ran.
struct RawParameterChange {
  double time_s = 0;
  std::string name;
  double value = 0;
};

/// What a file holds and the reader did not pass on.
struct RawSkip {
  std::string name;         ///< of the topic, message or field
  std::string why;          ///< e.g. "its format is not defined in the file"
  std::size_t records = 0;  ///< that were left out
};

struct RawLog {
  std::string path;
  std::string format;  ///< e.g. "ulog", "mcap", "rosbag2 sqlite", "ardupilot"
  std::vector<RawTopic> topics;
  std::map<std::string, double>
      parameters;  ///< the vehicle's parameters as the log starts, by their names in the file
  std::map<std::string, double> default_parameters;  ///< where the file states them
  std::vector<RawParameterChange> parameter_changes;
  std::vector<RawMessage> messages;
  std::vector<RawDropout> dropouts;
  std::vector<RawSkip> skipped;
  std::map<std::string, std::string> texts;  ///< what else the file says of itself, e.g. "sys_name"
  LogHealth health;
};

}  // namespace swarmcert::logs
