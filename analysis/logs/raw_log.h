/// @file A log file as its format stores it: topics with clocks of their own, and parameters. Readers of formats with several
/// topics fill this; what the columns mean is decided afterwards, in one place for all formats.
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

  /// The column of that name; nullptr if there is none.
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
  std::map<std::string, double> parameters;  ///< the vehicle's parameters, by their names in the file
  std::map<std::string, std::string> texts;  ///< what else the file says of itself, e.g. "sys_name"
  LogHealth health;
};

}  // namespace swarmcert::logs
