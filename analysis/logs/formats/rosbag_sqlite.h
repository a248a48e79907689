/// @file rosbag2 in SQLite (`.db3`), the default of ROS 2 before Iron.
#pragma once

#include <iosfwd>
#include <string>
#include <string_view>

#include "analysis/logs/raw_log.h"

namespace swarmcert::logs {

/// True if `head` starts as every SQLite database does.
bool looks_like_rosbag_sqlite(std::string_view head);

/// Topics as read_mcap(). Definitions of messages are taken from the database where it has them (since Iron), else from
/// ros_messages.h; topics of other types are named in `skipped`. Messages that were compressed one by one with zstd are
/// read.
///
/// The database is read from memory: nothing is written, locked or created, and a journal beside it is not applied;
/// where one holds messages, `health.truncated` is set and `skipped` names it. Views, triggers, virtual tables and
/// computed columns are refused, work and sizes are limited by the size of the file. At a damaged page reading ends;
/// what came before is kept.
/// @throws files::InputError if the file is empty, no SQLite database, or has no tables of a rosbag.
RawLog read_rosbag_sqlite(std::istream& in, const std::string& path);

}  // namespace swarmcert::logs
