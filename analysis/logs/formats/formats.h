/// @file The list of all supported log formats.
#pragma once

#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include "analysis/logs/raw_log.h"

namespace swarmcert::logs {

/// All formats, in the order in which they are tried: the name for messages, and the stem of the source and its
/// functions: STEM.cpp defines looks_like_STEM() and read_STEM().
#define SWARMCERT_LOG_FORMATS(FORMAT)        \
  FORMAT("micro-SD logs", usd)               \
  FORMAT("PX4 ULog", ulog)                   \
  FORMAT("rosbag2 in MCAP", mcap)            \
  FORMAT("rosbag2 in SQLite", rosbag_sqlite) \
  FORMAT("ArduPilot dataflash", dataflash)

#define SWARMCERT_DECLARE(name, stem)            \
  bool looks_like_##stem(std::string_view head); \
  RawLog read_##stem(std::string& bytes, const std::string& path);

SWARMCERT_LOG_FORMATS(SWARMCERT_DECLARE)
#undef SWARMCERT_DECLARE

/// How a format is recognised and read. `looks_like` decides by the first kFormatHead_bytes of a file, or fewer. `read`
/// may change the bytes; `path` is for messages and files beside this one.
struct LogFormat {
  const char* name;  ///< for messages, e.g. "PX4 ULog"
  bool (*looks_like)(std::string_view head);
  RawLog (*read)(std::string& bytes, const std::string& path);
};

inline constexpr std::size_t kFormatHead_bytes = 4096;

/// Returns the first kFormatHead_bytes of a stream and rewinds it.
std::string format_head(std::istream& in);

/// Returns the first kFormatHead_bytes of a file; nothing if it cannot be read, or is a pipe, which blocks whoever
/// opens it until somebody writes to it.
std::string head_of_file(const std::string& path);

/// Opens a log file.
/// @throws files::InputError if the file cannot be read or is a pipe.
std::ifstream open_log(const std::string& path);

/// Returns the formats in the order in which they are tried.
const std::vector<LogFormat>& log_formats();

/// Returns the format that `head` looks like; nullptr if there is none.
const LogFormat* format_of(std::string_view head);

/// Returns true for logs of programs that have to be converted first: ROS 1, MAVLink telemetry, Betaflight.
bool is_foreign_log(std::string_view head);

/// @throws files::InputError that says what the file is, if known, and what to do.
[[noreturn]] void refuse_unknown(std::string_view head, const std::string& path);

/// Appends `more` to `log`. Records of a common topic are appended to those of `log`; columns that only one of the two
/// has are NaN in the other.
void append(RawLog& log, RawLog&& more);

/// Returns true for a folder with a metadata.yaml of rosbag2.
bool looks_like_rosbag_folder(const std::string& path);

/// Reads the files of the folder as one log, in the order of metadata.yaml; topics continue from file to file. Only
/// files inside the folder are read, whatever metadata.yaml says. Files compressed as a whole (`.zstd`) are supported.
/// A file that is missing or cannot be read is listed in `left_out` and sets `health.truncated`.
/// @throws files::InputError if none of the files can be read.
RawLog read_rosbag_folder(const std::string& path);

/// Returns true for a folder whose CSV files all have names as `pose-20260131T12-00-59.csv`.
bool looks_like_cfclient_folder(const std::string& path);

/// Reads a session as one log with a topic for each block.
/// @throws files::InputError if a file cannot be read
RawLog read_cfclient_folder(const std::string& path);

/// Returns true for a folder that holds one log: a rosbag2 folder with its metadata.yaml, or a cfclient session.
bool is_log_folder(const std::string& path);

/// Reads a log file, whose format is recognised by its content, or a folder that holds one log: a rosbag2 folder or a
/// cfclient session.
/// @throws files::InputError if no format fits or the file cannot be read at all; states the offset or line. Damage
///   inside a file is not an error: it is skipped and counted in RawLog::health.
RawLog read_raw(const std::string& path);

/// Like read_raw() for a seekable stream; `path` is used only in messages. An old micro-SD log has columns only: see
/// set_times() in clock.h.
RawLog parse_raw(std::istream& in, const std::string& path);

}  // namespace swarmcert::logs
