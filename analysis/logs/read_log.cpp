#include "analysis/logs/read_log.h"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <limits>
#include <regex>
#include <sstream>

#include "analysis/logs/clock.h"
#include "analysis/logs/csv.h"
#include "analysis/logs/formats/formats.h"
#include "analysis/logs/interpretation.h"
#include "analysis/logs/variable_names.h"
#include "analysis/logs/vehicles_in_file.h"
#include "nn/base/input_error.h"

namespace swarmcert::logs {
namespace {

/// Returns whether the first bytes are text with a separator; a comment may have none.
bool looks_like_table(std::string_view head) {
  head = head.substr(0, 80);
  if (!head.empty() && head[0] == '#' && head.find('\0') == std::string_view::npos) return true;
  const bool is_text = std::all_of(head.begin(), head.end(), [](char c) {
    return static_cast<unsigned char>(c) >= ' ' || c == '\n' || c == '\r' || c == '\t';
  });
  const bool has_only_numbers = head.find_first_not_of("0123456789+-.eE \r\n") == std::string_view::npos;
  return is_text && (has_only_numbers || head.find_first_of(",;\t") != std::string_view::npos);
}
bool is_table(std::string_view head) { return format_of(head) == nullptr && looks_like_table(head); }

std::size_t bytes_in(std::istream& in) {
  in.seekg(0, std::ios::end);
  const std::streamoff size = in.tellg();
  in.clear();
  in.seekg(0);
  return size > 0 ? static_cast<std::size_t>(size) : 0;
}

RawLog raw_of(std::istream& in, const std::string& path, const SignalMap& map) {
  const std::size_t bytes = bytes_in(in);
  const std::string head = format_head(in);
  if (is_foreign_log(head)) refuse_unknown(head, path);
  RawLog log = is_table(head) ? read_table(in, path, map) : parse_raw(in, path);
  if (log.format == "usd") set_times(log, stated_clock(log, map));
  log.health.bytes = bytes;
  return log;
}

}  // namespace

Log parse_log(std::istream& in, const std::string& path, const SignalMap& map) {
  return interpret(raw_of(in, path, map), map);
}

namespace {

/// @param meaning as for interpret()
Log read_as(const std::string& path, const SignalMap& map, SignalMap* meaning) {
  RawLog raw = read_uninterpreted(path, map);
  // With a columns.toml, columns keep the names given in the log, because the file refers to those.
  const std::vector<std::string> named = map.empty() ? name_variables(raw) : std::vector<std::string>{};
  try {
    Log log = interpret(std::move(raw), map, meaning);
    log.interpretation.insert(log.interpretation.begin(), named.begin(), named.end());
    return log;
  } catch (const files::InputError& error) {
    files::InputFault fault = error.fault();
    for (const std::string& note : named) fault.hint = note + "; " + fault.hint;
    throw files::InputError(fault);
  }
}

}  // namespace

RawLog read_uninterpreted(const std::string& path, const SignalMap& map) {
  const LogAddress address = address_of(path);
  if (!address.vehicle.empty()) {
    std::istringstream in(table_of(address));
    return raw_of(in, path, map);
  }
  if (std::filesystem::is_directory(path)) return read_raw(path);
  refuse_several_vehicles(path, map.empty());
  std::ifstream in = open_log(path);
  return raw_of(in, path, map);
}

Log read_log(const std::string& path, const SignalMap& map) {
  if (map.empty()) return read_as(path, map, nullptr);
  // Who states what the evidence says anyway gets the same log, with the evidence.
  SignalMap meaning;
  try {
    Log log = read_as(path, {}, &meaning);
    if (is_same_meaning(meaning, map)) return log;
  } catch (const files::InputError&) {
    // The columns.toml may say what the evidence does not.
  }
  return read_as(path, map, nullptr);
}

SignalMap meaning_of_columns(const std::string& path, std::vector<std::string>& notes) {
  SignalMap meaning;
  try {
    notes = read_as(path, {}, &meaning).interpretation;
  } catch (const files::InputError& error) {
    if (meaning.empty()) throw;
    notes = {error.what()};
  }
  return meaning;
}

bool looks_like_log(const std::string& path) {
  if (!address_of(path).vehicle.empty()) return true;
  if (std::filesystem::is_directory(path)) return is_log_folder(path);
  if (is_log_name(std::filesystem::path(path).filename().string())) return true;
  if (std::filesystem::path(path).extension() == ".csv") return true;
  const std::string head = head_of_file(path);
  if (head.empty()) return false;
  return format_of(head) != nullptr || is_foreign_log(head) || (is_table(head) && is_flight_table(path));
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
    const std::string head = ends_of(path, kHead_bytes).first;
    if (!is_table(head)) return false;
    std::istringstream in(head);
    const RawLog log = read_table(in, path, {});
    const Recognition found = recognise(log, {});
    return found.find(kPosition) != nullptr || found.find(kVelocity) != nullptr ||
           found.find(kForceBody) != nullptr || has_torque_signals(found);
  } catch (const files::InputError&) {
    return false;
  }
}

Interval time_span_s(const std::string& path) {
  constexpr std::streamoff kEnd_bytes = 16384;
  try {
    const std::string first = head_of_file(path);
    if (looks_like_usd(first)) return {0, 0};  // its clock starts with the vehicle
    if (!is_table(first)) return absolute_span_s(read_raw(path));
    const auto [head, tail] = ends_of(path, kEnd_bytes);
    std::istringstream in(head.substr(0, head.rfind('\n') + 1) + tail);
    const RawLog log = read_table(in, path, {});
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

Completeness completeness_of(const LogHealth& health) {
  // A file that ends early has no checksum of the whole, and its last bytes are skipped.
  const bool is_damaged =
      health.damaged_blocks + health.damaged_lines + health.not_finite + health.clock_jumps > 0;
  const bool has_lost_bytes = health.skipped_bytes > 0 || health.checksum_failed;
  if (is_damaged || (has_lost_bytes && !health.truncated)) return Completeness::kDamaged;
  return health.truncated || health.dropouts_s > 0 ? Completeness::kCut : Completeness::kComplete;
}

double lost_share(const Log& log) {
  const LogHealth& health = log.health;
  if (completeness_of(health) == Completeness::kComplete) return 0;
  const auto share = [](double lost, double whole) { return lost > 0 && whole > 0 ? lost / whole : 0; };
  const auto dropped = static_cast<double>(health.not_finite + health.clock_jumps + health.damaged_lines);
  const double span_s =
      log.samples.empty() ? 0 : 1e-6 * (log.samples.back().time_us - log.samples.front().time_us);
  const double most =
      std::max({share(dropped, dropped + static_cast<double>(health.records)),
                share(static_cast<double>(health.skipped_bytes), static_cast<double>(health.bytes)),
                share(health.dropouts_s, span_s)});
  return health.truncated || most == 0 ? std::numeric_limits<double>::quiet_NaN() : std::min(most, 1.0);
}

bool is_sound(const LogHealth& health) {
  return completeness_of(health) != Completeness::kDamaged && !health.truncated;
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
  if (health.dropouts_s > 0)
    found.push_back(fmt::format("{:.3f} s in which the vehicle could not write", health.dropouts_s));
  if (health.gaps > 0) {
    found.push_back(
        fmt::format("{} gaps over 30 ms, the longest {:.3f} s", health.gaps, health.longest_gap_s));
  }
  if (health.checksum_failed) found.emplace_back("the checksum of the whole file is wrong");
  if (health.truncated) found.emplace_back("the file ends inside a record");
  return found;
}

}  // namespace swarmcert::logs
