#include "analysis/logs/formats/formats.h"

#include <filesystem>
#include <fstream>

#include "analysis/logs/formats/crazyflie_csv.h"
#include "analysis/logs/formats/rosbag_folder.h"
#include "nn/base/input_error.h"

namespace swarmcert::logs {

/// All formats, in the order in which they are tried: the name for messages, and the stem of the source and its
/// functions. <stem>.cpp defines looks_like_<stem>() and read_<stem>().
#define SWARMCERT_LOG_FORMATS(FORMAT)        \
  FORMAT("PX4 ULog", ulog)                   \
  FORMAT("rosbag2 in MCAP", mcap)            \
  FORMAT("rosbag2 in SQLite", rosbag_sqlite) \
  FORMAT("ArduPilot dataflash", dataflash)   \
  FORMAT("CSV of Crazyflie log variables", crazyflie_csv)

#define SWARMCERT_DECLARE(name, stem)            \
  bool looks_like_##stem(std::string_view head); \
  RawLog read_##stem(std::istream& in, const std::string& path);
#define SWARMCERT_ENTRY(name, stem) {name, looks_like_##stem, read_##stem},

SWARMCERT_LOG_FORMATS(SWARMCERT_DECLARE)

namespace {

[[noreturn]] void refuse_unknown(const std::string& path, bool is_empty) {
  if (is_empty)
    throw files::InputError(
        {path, "offset 0", "", "", "the file is empty", "the recording failed; exclude this file"});
  std::string known;
  for (const LogFormat& format : log_formats())
    known += (known.empty() ? "" : ", ") + std::string(format.name);
  throw files::InputError({path, "offset 0", "", "", "is not a flight log", "supported are " + known});
}

}  // namespace

const std::vector<LogFormat>& log_formats() {
  static const std::vector<LogFormat> formats = {SWARMCERT_LOG_FORMATS(SWARMCERT_ENTRY)};
  return formats;
}

std::string format_head(std::istream& in) {
  std::string head(kFormatHead_bytes, '\0');
  in.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(in.gcount()));
  in.clear();
  in.seekg(0);
  return head;
}

bool is_pipe(const std::string& path) {
  std::error_code ignored;
  return std::filesystem::is_fifo(path, ignored);
}

std::ifstream open_log(const std::string& path) {
  if (is_pipe(path))
    throw files::InputError({path, "", "", "", "is a pipe", "write its contents to a file and name that"});
  std::ifstream in(path, std::ios::binary);
  if (!in) throw files::InputError({path, "", "", "", "cannot be read", "check its name and permissions"});
  return in;
}

const LogFormat* format_of(std::string_view head) {
  for (const LogFormat& format : log_formats())
    if (format.looks_like(head)) return &format;
  return nullptr;
}

const LogFormat* format_of_file(const std::string& path) {
  if (is_pipe(path)) return nullptr;
  std::ifstream in(path, std::ios::binary);
  return in ? format_of(format_head(in)) : nullptr;
}

RawLog parse_raw(std::istream& in, const std::string& path) {
  const std::string head = format_head(in);
  const LogFormat* const format = format_of(head);
  if (format == nullptr) refuse_unknown(path, head.empty());
  return format->read(in, path);
}

bool is_log_folder(const std::string& path) {
  return looks_like_rosbag_folder(path) || looks_like_cfclient_folder(path);
}

RawLog read_raw(const std::string& path) {
  if (looks_like_rosbag_folder(path)) return read_rosbag_folder(path);
  if (looks_like_cfclient_folder(path)) return read_cfclient_folder(path);
  std::ifstream in = open_log(path);
  return parse_raw(in, path);
}

}  // namespace swarmcert::logs

#undef SWARMCERT_LOG_FORMATS
#undef SWARMCERT_DECLARE
#undef SWARMCERT_ENTRY
