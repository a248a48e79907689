/// @file rosbag2 in MCAP (`.mcap`).
#pragma once

#include <iosfwd>
#include <string>
#include <string_view>

#include "analysis/logs/raw_log.h"

namespace swarmcert::logs {

/// Returns true if `head` starts with the magic number of MCAP.
bool looks_like_mcap(std::string_view head);

/// Reads the topics of ROS 2 messages (encoding "cdr", definitions "ros2msg"). Times are the messages' log times, in
/// seconds since 1970 or on whatever clock the recorder used. Chunks may be uncompressed or compressed with zstd or
/// lz4. The summary section is not needed. A chunk with a wrong checksum is skipped and counted; of a truncated chunk,
/// the part before the cut is kept. Topics with other encodings are listed in `skipped`. If the records become invalid,
/// the reader searches for the next byte at which two valid records follow each other.
/// @throws files::InputError if the file is empty or not an MCAP file.
RawLog read_mcap(std::istream& in, const std::string& path);

}  // namespace swarmcert::logs
