/// @file Every log format that can be read, in one list.
#pragma once

#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include "analysis/logs/raw_log.h"

namespace swarmcert::logs {

/// How a format is recognised and read. `looks_like` decides by the first kFormatHead_bytes of a file, or all of a
/// shorter one.
struct LogFormat {
  const char* name;  ///< for messages, e.g. "PX4 ULog"
  bool (*looks_like)(std::string_view head);
  RawLog (*read)(std::istream& in, const std::string& path);
};

inline constexpr std::size_t kFormatHead_bytes = 4096;

/// The first kFormatHead_bytes of a stream, which stands at its start again.
std::string format_head(std::istream& in);

/// @throws files::InputError if the file cannot be read.
std::ifstream open_log(const std::string& path);

/// In the order in which they are tried.
const std::vector<LogFormat>& log_formats();

/// The format that `head` looks like; nullptr if none.
const LogFormat* format_of(std::string_view head);
/// As format_of(), of the file's first bytes; nullptr also where it cannot be read.
const LogFormat* format_of_file(const std::string& path);

/// True for a folder that is one log: a bag of rosbag2 with its metadata.yaml, a session of cfclient.
bool is_log_folder(const std::string& path);

/// Reads a log whose format is recognised by its content, or a folder that is one log: a bag of rosbag2,
/// a session of cfclient.
/// @throws files::InputError if no format fits, or the file cannot be read at all, with offset or line. Damage inside a
///   file is no error: it is skipped and counted in RawLog::health.
RawLog read_raw(const std::string& path);

/// As read_raw(), from a stream that can seek; `path` is used in messages only.
RawLog parse_raw(std::istream& in, const std::string& path);

}  // namespace swarmcert::logs
