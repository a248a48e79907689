#include "analysis/logs/read_log.h"

#include <fmt/core.h>

#include <filesystem>
#include <fstream>
#include <regex>

#include "analysis/logs/byte_window.h"
#include "nn/base/input_error.h"

namespace swarmcert::logs {
namespace {

enum class Format { kUsd, kUsdEvents, kCsv, kUnknown };

/// By the first bytes. An old binary log starts with a number of variables and "name(type),", which may look like
/// text: its header has no line end before its checksum.
Format format_of(std::istream& in) {
  char head[80] = {};
  in.read(head, sizeof head);
  const auto size = static_cast<std::size_t>(in.gcount());
  in.clear();
  in.seekg(0);
  const std::string start(head, size);
  if (size >= 3 && static_cast<unsigned char>(start[0]) == 0xBC && start[2] == 0) return Format::kUsdEvents;
  const std::size_t bracket = start.find('(');
  if (bracket != std::string::npos && bracket >= 2 && bracket + 3 < size && start[bracket + 2] == ')' &&
      start[bracket + 3] == ',')
    return Format::kUsd;
  for (const char c : start) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < ' ' && c != '\n' && c != '\r' && c != '\t') return Format::kUnknown;
  }
  return start.find_first_of(",;\t") == std::string::npos ? Format::kUnknown : Format::kCsv;
}

std::ifstream open(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw files::InputError({path, "", "", "", "cannot be read", "check its name and permissions"});
  return in;
}

}  // namespace

Log parse_log(std::istream& in, const std::string& path, const SignalMap& map) {
  Log log;
  log.path = path;
  SampleBuilder builder(log, map);
  switch (format_of(in)) {
    case Format::kUsd:
      log.format = "usd";
      read_usd(in, path, builder, log.health);
      break;
    case Format::kUsdEvents:
      log.format = fmt::format("usd version {}", read_usd_events(in, path, builder, log.health));
      break;
    case Format::kCsv:
      log.format = "csv";
      read_csv(in, path, builder, log.health);
      break;
    case Format::kUnknown: {
      const bool empty = in.peek() == std::char_traits<char>::eof();
      throw files::InputError({path, "offset 0", "", "", empty ? "the file is empty" : "is not a flight log",
                               empty ? "the recording failed; leave it out"
                                     : "known are micro-SD logs (old, version 1, version 2) and CSV"});
    }
  }
  builder.end();
  return log;
}

Log read_log(const std::string& path, const SignalMap& map) {
  std::ifstream in = open(path);
  return parse_log(in, path, map);
}

bool looks_like_log(const std::string& path) {
  if (is_log_name(std::filesystem::path(path).filename().string())) return true;
  if (std::filesystem::path(path).extension() == ".csv") return true;
  std::ifstream in(path, std::ios::binary);
  if (!in) return false;
  const Format format = format_of(in);
  return format == Format::kUsd || format == Format::kUsdEvents;
}

bool is_log_name(const std::string& name) {
  static const std::regex kPattern("(.*_)?cf[0-9]+_[0-9]+([.]csv)?");
  return std::regex_match(name, kPattern);
}

void write_csv(const Log& log, double t0_s, double t1_s, std::ostream& out) {
  out << "# time[ms],x[m],y[m],z[m],vx[m/s],vy[m/s],vz[m/s],ax[m/s^2],ay[m/s^2],az[m/s^2],qx,qy,qz,qw,"
         "u1[N],u2[N],u3[N],u4[N],u1[PWM],u2[PWM],u3[PWM],u4[PWM],Vbat[V],thrust_des[g],torquex[Nm],torquey["
         "Nm],"
         "torquez[Nm],wx[rad/s],wy[rad/s],wz[rad/s]\n";
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
    add(s.attitude);
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
  add(health.damaged_lines, "lines that are not as many numbers as the header names");
  add(health.not_finite, "records with values that are not finite");
  add(health.clock_jumps, "records whose time does not follow the one before");
  if (health.gaps > 0) {
    found.push_back(
        fmt::format("{} gaps over 30 ms, the longest {:.3f} s", health.gaps, health.longest_gap_s));
  }
  if (health.checksum_failed) found.emplace_back("the checksum of the whole file is wrong");
  if (health.truncated) found.emplace_back("the file ends inside a record");
  return found;
}

}  // namespace swarmcert::logs
