/// @file rosbag2 in MCAP (`.mcap`).
#pragma once

#include <iosfwd>
#include <string>
#include <string_view>

#include "analysis/logs/raw_log.h"

namespace swarmcert::logs {

/// True if the magic number of MCAP starts `head`.
bool looks_like_mcap(std::string_view head);

/// Topics of ROS 2 messages (encoding "cdr", definitions "ros2msg"), times from the log time of the messages, in
/// seconds since 1970 or whatever clock the recorder used. Chunks without compression, zstd and lz4. The summary
/// section is not needed. A chunk whose checksum is wrong is left out and counted; of a chunk that the file cuts short,
/// what comes before the cut is kept. Topics of other encodings are named in `skipped`. Where records stop making
/// sense, the reader looks for the next byte from which two sound ones follow each other.
/// @throws files::InputError if the file is empty or no MCAP.
RawLog read_mcap(std::istream& in, const std::string& path);

}  // namespace swarmcert::logs
