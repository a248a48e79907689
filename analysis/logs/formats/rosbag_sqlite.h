/// @file rosbag2 in SQLite (`.db3`), the default of ROS 2 before Iron.
#pragma once

#include <iosfwd>
#include <string>
#include <string_view>

#include "analysis/logs/raw_log.h"

namespace swarmcert::logs {

/// Returns true if `head` starts with the header of an SQLite database.
bool looks_like_rosbag_sqlite(std::string_view head);

/// Reads topics as read_mcap() does. Message definitions are taken from the database if it has them (since Iron), else
/// from ros_messages.h; topics of other types are listed in `skipped`. Single messages compressed with zstd are
/// supported.
///
/// The database is read from memory: nothing is written, locked or created. A journal beside it is not applied; if it
/// holds messages, `health.truncated` is set and `skipped` lists it. Views, triggers, virtual tables and computed
/// columns are refused; work and sizes are limited by the size of the file. Reading stops at a damaged page; everything
/// before it is kept.
/// @throws files::InputError if the file is empty, is not an SQLite database, or does not have the tables of a rosbag.
RawLog read_rosbag_sqlite(std::istream& in, const std::string& path);

}  // namespace swarmcert::logs
