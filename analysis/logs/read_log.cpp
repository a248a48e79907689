#include "analysis/logs/read_log.h"

#include <fmt/core.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>

#include "analysis/logs/absolute_time.h"
#include "analysis/logs/byte_window.h"
#include "analysis/logs/collector.h"
#include "analysis/logs/formats/formats.h"
#include "analysis/logs/interpretation.h"
#include "analysis/logs/variable_names.h"
#include "analysis/logs/vehicles_in_file.h"
#include "nn/base/input_error.h"

namespace swarmcert::logs {
namespace {

enum class Format { kUsd, kUsdEvents, kCsv, kUnknown };

/// Returns the format by the first bytes. An old binary log starts with the number of variables and "name(type),",
/// which may look like text, but its header has no line end before its checksum.
Format kind_of(std::istream& in) {
  char head[80] = {};
  in.read(head, sizeof head);
  const auto size = static_cast<std::size_t>(in.gcount());
  in.clear();
  in.seekg(0);
  const std::string start(head, size);
  if (size >= 3 && static_cast<unsigned char>(start[0]) == 0xBC && start[2] == 0) return Format::kUsdEvents;
  // "Time (s),X (m)" of a CSV is not such a list: names contain no blanks, and "s" is not a type.
  const std::size_t bracket = start.find('(');
  if (bracket != std::string::npos && bracket >= 2 && bracket + 3 < size && start[bracket + 2] == ')' &&
      start[bracket + 3] == ',' && size_of(start[bracket + 1]) > 0 && start[bracket - 1] != ' ')
    return Format::kUsd;
  if (start[0] == '#' && start.find('\0') == std::string::npos)
    return Format::kCsv;  // a comment may have no separator
  for (const char c : start) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < ' ' && c != '\n' && c != '\r' && c != '\t') return Format::kUnknown;
  }
  return start.find_first_of(",;\t") == std::string::npos ? Format::kUnknown : Format::kCsv;
}

std::string other_formats() {
  std::string names;
  for (const LogFormat& format : log_formats()) names += std::string(", ") + format.name;
  return names;
}

[[noreturn]] void refuse_unknown(const std::string& head, const std::string& path) {
  std::string what = "is not a flight log", hint = "supported are micro-SD logs, CSV" + other_formats();
  if (head.empty()) {
    what = "the file is empty";
    hint = "the recording failed; exclude this file";
  } else if (head.compare(0, 2, "\x1F\x8B") == 0) {
    what = "is compressed";
    hint = "unpack it with gunzip";
  } else if (head.compare(0, 2, "\xFF\xFE") == 0 || head.compare(0, 2, "\xFE\xFF") == 0) {
    what = "is text in UTF-16";
    hint = "save it as UTF-8";
  }
  throw files::InputError({path, "offset 0", "", "", what, hint});
}

/// Micro-SD logs and CSV files are streams of records; formats/formats.h handles the other formats.
RawLog raw_of(std::istream& in, const std::string& path, const SignalMap& map) {
  const std::string head = format_head(in);
  // The header of an old micro-SD log names variables like a CSV header. A columns.toml always takes precedence.
  const Format kind = kind_of(in);
  const bool is_usd = kind == Format::kUsd || kind == Format::kUsdEvents;
  if (!is_usd && format_of(head) != nullptr && (map.empty() || kind != Format::kCsv))
    return parse_raw(in, path);
  RawLog log;
  log.path = path;
  Collector collector(log, map);
  switch (kind) {
    case Format::kUsd:
      log.format = "usd";
      read_usd(in, path, collector, log.health);
      collector.end();
      break;
    case Format::kUsdEvents:
      log.format = fmt::format("usd version {}", read_usd_events(in, path, log));
      break;
    case Format::kCsv: {
      log.format = "csv";
      const std::optional<files::InputFault> damage = read_csv(in, path, collector, log.health);
      collector.end();
      if (damage && log.topics.front().time_s.empty())
        throw files::InputError(*damage);  // no line can be read
      break;
    }
    case Format::kUnknown:
      refuse_unknown(head, path);
  }
  return log;
}

}  // namespace

Log parse_log(std::istream& in, const std::string& path, const SignalMap& map) {
  return interpret(raw_of(in, path, map), map);
}

Log read_log(const std::string& path, const SignalMap& map) {
  RawLog raw;
  const LogAddress address = address_of(path);
  if (!address.vehicle.empty()) {
    std::istringstream in(table_of(address));
    raw = raw_of(in, path, map);
  } else if (std::filesystem::is_directory(path)) {
    raw = read_raw(path);
  } else {
    refuse_several_vehicles(path, map.empty());
    std::ifstream in = open_log(path);
    raw = raw_of(in, path, map);
  }
  // With a columns.toml, columns keep the names given in the log, because the file refers to those.
  const std::vector<std::string> named = map.empty() ? name_variables(raw) : std::vector<std::string>{};
  try {
    Log log = interpret(std::move(raw), map);
    log.interpretation.insert(log.interpretation.begin(), named.begin(), named.end());
    return log;
  } catch (const files::InputError& error) {
    files::InputFault fault = error.fault();
    for (const std::string& note : named) fault.hint = note + "; " + fault.hint;
    throw files::InputError(fault);
  }
}

bool looks_like_log(const std::string& path) {
  if (!address_of(path).vehicle.empty()) return true;
  if (std::filesystem::is_directory(path)) return is_log_folder(path);
  if (is_log_name(std::filesystem::path(path).filename().string())) return true;
  if (std::filesystem::path(path).extension() == ".csv") return true;
  if (format_of_file(path) != nullptr) return true;
  if (is_pipe(path)) return false;
  std::ifstream in(path, std::ios::binary);
  if (!in) return false;
  const Format format = kind_of(in);
  if (format == Format::kCsv) return is_flight_table(path);
  return format == Format::kUsd || format == Format::kUsdEvents;
}

namespace {

/// Returns the first `bytes` of a file and the same number at its end, each without partial lines.
std::pair<std::string, std::string> ends_of(const std::string& path, std::streamoff bytes) {
  std::ifstream in(path, std::ios::binary);
  in.seekg(0, std::ios::end);
  const std::streamoff size = in.tellg();
  if (!in || size <= 0) return {};
  const auto part = [&](std::streamoff from, std::streamoff count) {
    std::string text(static_cast<std::size_t>(count), '\0');
    in.seekg(from);
    in.read(text.data(), count);
    return text;
  };
  std::string head = part(0, std::min(bytes, size)),
              tail = part(std::max<std::streamoff>(0, size - bytes), std::min(bytes, size));
  if (size > bytes) {
    head.erase(std::min(head.size(), head.rfind('\n') + 1));
    tail.erase(0, tail.find('\n') + 1);
  }
  return {head, tail};
}

}  // namespace

bool is_flight_table(const std::string& path) {
  constexpr std::streamoff kHead_bytes = 16384;
  try {
    std::istringstream in(ends_of(path, kHead_bytes).first);
    if (kind_of(in) != Format::kCsv) return false;
    RawLog log;
    Collector collector(log, known_columns());
    read_csv(in, path, collector, log.health);
    collector.end();
    const Recognition found = recognise(log, known_columns());
    return found.find(kPosition) != nullptr || found.find(kVelocity) != nullptr ||
           found.find(kForceBody) != nullptr;
  } catch (const files::InputError&) {
    return false;
  }
}

Interval time_span_s(const std::string& path) {
  constexpr std::streamoff kEnd_bytes = 16384;
  try {
    std::ifstream whole(path, std::ios::binary);
    const Format kind = kind_of(whole);
    if (kind == Format::kUsd || kind == Format::kUsdEvents)
      return {0, 0};  // their clocks start with the vehicle
    if (kind != Format::kCsv || format_of_file(path) != nullptr) return absolute_span_s(read_raw(path));
    const auto [head, tail] = ends_of(path, kEnd_bytes);
    std::istringstream in(head.substr(0, head.rfind('\n') + 1) + tail);
    RawLog log;
    Collector collector(log, known_columns());
    read_csv(in, path, collector, log.health);
    collector.end();
    const std::vector<double>& times = log.topics.front().time_s;
    return times.empty() ? Interval() : Interval(times.front(), times.back());
  } catch (const files::InputError&) {
    return {0, 0};
  }
}

bool is_log_name(const std::string& name) {
  static const std::regex kPattern("(.*_)?cf[0-9]+_[0-9]+([.]csv)?");
  return std::regex_match(name, kPattern);
}

void write_csv(const Log& log, double t0_s, double t1_s, std::ostream& out) {
  out << "# "
         "time[ms],x[m],y[m],z[m],vx[m/s],vy[m/s],vz[m/s],ax[m/s^2],ay[m/s^2],az[m/"
         "s^2],qx,qy,qz,qw,u1[N],u2[N],u3[N],u4[N],u1[PWM],u2[PWM],u3[PWM],u4[PWM],Vbat[V],thrust_des[g],"
         "torquex[Nm],torquey[Nm],torquez[Nm],wx[rad/s],wy[rad/s],wz[rad/s]\n";
  std::string line;
  const auto add = [&line](const auto& values) {
    for (const double value : values) line += fmt::format(",{:.18e}", value);
  };
  for (const Sample& s : log.samples) {
    const double time_s = s.time_us * 1e-6;
    if (time_s < t0_s || time_s >= t1_s) continue;
    line = fmt::format("{:.18e}", s.time_us);
    add(s.position_m);
    add(s.velocity_m_s);
    add(s.specific_force_m_s2);
    add(s.attitude.xyzw());
    add(s.motor_force_N);
    add(s.duty);
    add(std::array<double, 2>{s.battery_V, s.thrust_command_N / kGravity_m_s2 * 1000});
    add(s.torque_command_Nm);
    add(s.rates_rad_s);
    out << line << '\n';
  }
}

bool is_sound(const LogHealth& health) {
  return health.damaged_blocks + health.skipped_bytes + health.damaged_lines + health.not_finite +
                 health.clock_jumps ==
             0 &&
         !health.truncated && !health.checksum_failed;
}

std::vector<std::string> findings(const LogHealth& health) {
  std::vector<std::string> found;
  const auto add = [&found](std::size_t count, const char* what) {
    if (count > 0) found.push_back(fmt::format("{} {}", count, what));
  };
  add(health.damaged_blocks, "damaged places skipped");
  add(health.skipped_bytes, "bytes skipped there");
  add(health.damaged_lines, "lines whose number of values differs from the header");
  add(health.not_finite, "records with values that are not finite");
  add(health.clock_jumps, "records whose time does not follow the previous one");
  if (health.gaps > 0) {
    found.push_back(
        fmt::format("{} gaps over 30 ms, the longest {:.3f} s", health.gaps, health.longest_gap_s));
  }
  if (health.checksum_failed) found.emplace_back("the checksum of the whole file is wrong");
  if (health.truncated) found.emplace_back("the file ends inside a record");
  return found;
}

}  // namespace swarmcert::logs
