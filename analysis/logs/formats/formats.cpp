#include "analysis/logs/formats/formats.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "analysis/logs/formats/bytes.h"
#include "nn/base/input_error.h"

namespace swarmcert::logs {

#define SWARMCERT_ENTRY(name, stem) {name, looks_like_##stem, read_##stem},

namespace {

/// A .tlog is a sequence of a time in microseconds since 1970, big-endian, and a packet, which begins with its length.
bool looks_like_mavlink(std::string_view head) {
  constexpr std::size_t kTime_bytes = 8, kFewest = 3;
  std::size_t at = 0, packets = 0;
  for (; at + kTime_bytes + 2 < head.size(); ++packets) {
    const auto byte = [&](std::size_t k) { return static_cast<unsigned char>(head[at + k]); };
    std::uint64_t time_us = 0;
    for (std::size_t k = 0; k < kTime_bytes; ++k) time_us = time_us << 8 | byte(k);
    const bool is_first = byte(8) == 0xFE, is_second = byte(8) == 0xFD, is_signed = (byte(10) & 1) != 0;
    if (time_us < 946684800000000 || time_us > 4102444800000000 || !(is_first || is_second)) return false;
    at += kTime_bytes + byte(9) + (is_first ? 8 : is_signed ? 25 : 12);
  }
  return packets >= kFewest;
}

bool starts_with(std::string_view head, std::string_view start) {
  return head.substr(0, start.size()) == start;
}

/// What is no log that can be read, and how it becomes one.
struct ForeignFormat {
  bool (*looks_like)(std::string_view head);
  const char *what, *hint;
  bool is_log;
};
const ForeignFormat* foreign_format_of(std::string_view head) {
  static const ForeignFormat formats[] = {
      {[](std::string_view h) { return starts_with(h, "#ROSBAG V"); }, "is a ROS 1 bag",
       "convert it to ROS 2: rosbags-convert --src FILE --dst FOLDER (Python package rosbags)", true},
      {looks_like_mavlink, "is a MAVLink telemetry log (.tlog)",
       "read the log that the vehicle wrote itself (.ulg, .bin), which has more signals, or write a table: "
       "mavlogdump.py --format csv --types LOCAL_POSITION_NED FILE (Python package pymavlink)",
       true},
      {[](std::string_view h) { return starts_with(h, "H Product:Blackbox"); },
       "is a Blackbox log of Betaflight or INAV", "write it as CSV: blackbox_decode FILE", true},
      {[](std::string_view h) { return h.empty(); }, "the file is empty",
       "the recording failed; exclude this file", false},
      {[](std::string_view h) { return starts_with(h, "\x1F\x8B"); }, "is compressed",
       "unpack it with gunzip", false},
      {[](std::string_view h) { return starts_with(h, "\xFF\xFE") || starts_with(h, "\xFE\xFF"); },
       "is text in UTF-16", "save it as UTF-8", false}};
  const auto* const found = std::find_if(std::begin(formats), std::end(formats),
                                         [&](const ForeignFormat& f) { return f.looks_like(head); });
  return found == std::end(formats) ? nullptr : found;
}

bool is_pipe(const std::string& path) {
  std::error_code ignored;
  return std::filesystem::is_fifo(path, ignored);
}

}  // namespace

bool is_foreign_log(std::string_view head) {
  const ForeignFormat* const foreign = foreign_format_of(head);
  return foreign != nullptr && foreign->is_log;
}

void refuse_unknown(std::string_view head, const std::string& path) {
  if (const ForeignFormat* const foreign = foreign_format_of(head))
    throw files::InputError({path, "offset 0", "", "", foreign->what, foreign->hint});
  std::string hint = "supported are CSV";
  for (const LogFormat& format : log_formats()) hint += std::string(", ") + format.name;
  throw files::InputError({path, "offset 0", "", "", "is not a flight log", hint});
}

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

std::string head_of_file(const std::string& path) {
  std::ifstream in;
  if (!is_pipe(path)) in.open(path, std::ios::binary);
  return format_head(in);
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

RawLog parse_raw(std::istream& in, const std::string& path) {
  const std::string head = format_head(in);
  const LogFormat* const format = format_of(head);
  if (format == nullptr) refuse_unknown(head, path);
  std::string bytes = read_all(in, path);
  return format->read(bytes, path);
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

#undef SWARMCERT_ENTRY
