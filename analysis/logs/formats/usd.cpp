/// @file Logs of the Crazyflie's micro-SD deck: the old format, and the formats with magic 0xBC.
///
/// Old: u8 number of variables, that many "name(type)," tokens, u32 checksum; then blocks of u8 n, n packed
/// little-endian records, u32 checksum over both. The stored checksum is the bitwise NOT of CRC-32. A block with a
/// wrong checksum is skipped: the reader searches for the next byte at which a valid block with a plausible time
/// starts.
///
/// Versions 1 (times in ms) and 2 (times in us): the file ends with the CRC-32 of everything before it. Each record
/// belongs to an event, and each event becomes a topic with its own times. If no known event follows, the reader
/// searches for the next byte from which three records with increasing times follow each other.
#include <fmt/core.h>

#include <algorithm>
#include <istream>
#include <utility>
#include <vector>

#include "analysis/logs/formats/bytes.h"
#include "analysis/logs/raw_log.h"
#include "nn/base/input_error.h"

namespace swarmcert::logs {
namespace {

constexpr std::size_t kLongestName_bytes = 64, kChecksum_bytes = 4;
constexpr std::size_t kLargestHeader_bytes = std::size_t{1} << 16;
constexpr std::string_view kUsdTypes = "bBhHiIf";  // as in Python's struct module
constexpr double kLater_us = 600e6;                // after the record before damage

/// The variables of a record.
struct UsdVariables {
  std::vector<std::string> names;
  std::vector<std::pair<Scalar, std::size_t>> places;  ///< type and offset
  std::size_t record_bytes = 0;

  /// Reads "name(type)", terminated by `end`, at `at` of `bytes` and moves `at` behind it. The name must not contain
  /// control characters.
  void read(std::string_view bytes, const std::string& path, char end, std::size_t& at) {
    const std::string_view rest = bytes.substr(std::min(at, bytes.size()), kLongestName_bytes);
    const std::size_t size = rest.find(end);
    const std::string token(size == std::string_view::npos ? "" : rest.substr(0, size));
    const bool is_token = token.size() >= 4 && token[token.size() - 3] == '(' && token.back() == ')' &&
                          std::all_of(token.begin(), token.end(), [](char c) { return c > ' ' && c < 127; });
    if (!is_token)
      refuse_at(path, at, "variable " + std::to_string(names.size() + 1), files::in_quotes(token),
                "is not of the form name(type)", "is this a micro-SD log?");
    const std::string name = token.substr(0, token.size() - 3);
    const char type = token[token.size() - 2];
    if (kUsdTypes.find(type) == std::string_view::npos)
      refuse_at(path, at, name, files::in_quotes(std::string(1, type)), "is not a known type",
                "supported are b B h H i I f");
    if (std::find(names.begin(), names.end(), name) != names.end())
      refuse_at(path, at, name, "", "is named twice", "log each variable once");
    names.push_back(name);
    places.emplace_back(*scalar_of_letter(type), record_bytes);
    record_bytes += size_of(places.back().first);
    at += token.size() + 1;
  }

  RawTopic topic(const std::string& name) const {
    RawTopic topic;
    topic.name = name;
    for (const std::string& column : names) topic.columns.push_back({column, {}});
    return topic;
  }
  void add_record(const char* record, RawTopic& topic) const {
    for (std::size_t i = 0; i < places.size(); ++i)
      topic.columns[i].values.push_back(value_of(places[i].first, record + places[i].second));
  }
};

/// Reads what starts at bytes between `at` and `end`: `size_at` returns its size, 0 if nothing does, `take` reads it,
/// and `ends_early` says whether the file ends within what should be there. Counts what lies between.
template <typename SizeAt, typename EndsEarly, typename Take>
void read_between_damage(std::size_t at, std::size_t end, LogHealth& health, const SizeAt& size_at,
                         const EndsEarly& ends_early, const Take& take) {
  bool searching = false, is_cut = false;
  while (at < end) {
    const std::size_t size = size_at(at, searching);
    if (size == 0) {
      if (!searching) is_cut = ends_early(at);
      health.damaged_blocks += searching ? 0 : 1;
      ++health.skipped_bytes;
    } else {
      take(at);
    }
    searching = size == 0;
    at += std::max<std::size_t>(size, 1);
  }
  health.truncated = searching;
  health.damaged_blocks -= searching && is_cut ? 1 : 0;
}

RawLog read_blocks(const std::string& bytes, const std::string& path) {
  const std::size_t num_variables = static_cast<unsigned char>(bytes[0]);
  if (num_variables == 0) refuse_at(path, 0, "number of variables", "0", "no variable was logged", "");
  UsdVariables variables;
  std::size_t begin = 1;
  while (variables.names.size() < num_variables) variables.read(bytes, path, ',', begin);
  const std::optional<std::uint32_t> stored = integer_at<std::uint32_t>(bytes, begin);
  if (!stored) refuse_at(path, begin, "header", "", "the file ends inside the header", "");
  if (*stored != ~crc32_of({bytes.data(), begin}))
    refuse_at(path, begin, "header", "", "its checksum is wrong", "copy the file again from the card");
  RawLog log;
  log.topics.push_back(variables.topic(""));
  const auto count_at = [&](std::size_t at) { return std::size_t{static_cast<unsigned char>(bytes[at])}; };
  const auto body_at = [&](std::size_t at) { return 1 + count_at(at) * variables.record_bytes; };
  const auto fits = [&](std::size_t at) { return body_at(at) + kChecksum_bytes <= bytes.size() - at; };
  std::uint32_t last_time = 0;
  // After damage, a block is not empty and its first time is soon after the last. This avoids a checksum at almost
  // every byte; an empty block is only five bytes, which occur by chance.
  const auto may_start = [&](std::size_t at) {
    if (count_at(at) == 0 || bytes.size() - at < 1 + variables.record_bytes) return false;
    if (variables.places[0].first != Scalar::kUint32) return true;
    return *integer_at<std::uint32_t>(bytes, at + 1) - last_time < static_cast<std::uint32_t>(kLater_us);
  };
  // Limits the work on malicious files, which could request a checksum over thousands of bytes at each byte.
  constexpr std::size_t kMostSearch_bytes = std::size_t{4} << 30;
  std::size_t work_bytes = 0;
  const auto size_at = [&](std::size_t at, bool searching) -> std::size_t {
    if (searching && (work_bytes >= kMostSearch_bytes || !may_start(at))) return 0;
    if (!fits(at)) return 0;
    const std::size_t body = body_at(at);
    work_bytes += body;
    const bool is_sound =
        *integer_at<std::uint32_t>(bytes, at + body) == ~crc32_of({bytes.data() + at, body});
    return is_sound ? body + kChecksum_bytes : 0;
  };
  const auto ends_early = [&](std::size_t at) { return !fits(at); };
  read_between_damage(begin + kChecksum_bytes, bytes.size(), log.health, size_at, ends_early,
                      [&](std::size_t at) {
                        ++log.health.blocks;
                        for (std::size_t i = 0; i < count_at(at); ++i) {
                          variables.add_record(&bytes[at + 1 + i * variables.record_bytes], log.topics[0]);
                          last_time = static_cast<std::uint32_t>(log.topics[0].columns[0].values.back());
                        }
                      });
  log.format = "usd";
  return log;
}

class EventReader {
 public:
  EventReader(const std::string& bytes, const std::string& path) : bytes_(bytes) { log_.path = path; }

  RawLog read() {
    const int version = number<std::uint16_t>(1, "header");
    if (version != 1 && version != 2)
      refuse_at(log_.path, 1, "version", std::to_string(version), "is not known", "supported are 1 and 2");
    is_in_ms_ = version == 1;
    log_.format = fmt::format("usd version {}", version);
    const std::size_t num_events = number<std::uint16_t>(3, "header");
    std::size_t at = 5;
    for (std::size_t i = 0; i < num_events; ++i) read_event(at);
    if (events_.empty()) refuse_at(log_.path, 3, "number of events", "0", "nothing was logged", "");
    read_records(at);
    return std::move(log_);
  }

 private:
  template <typename Integer>
  Integer number(std::size_t at, const char* field) const {
    const std::optional<Integer> value = integer_at<Integer>(bytes_, at);
    if (!value) refuse_at(log_.path, at, field, "", "the file ends inside the header", "");
    return *value;
  }

  void demand_short_header(std::size_t at, std::size_t now) const {
    if (now > kLargestHeader_bytes)
      refuse_at(log_.path, at, "header", "", "is longer than the firmware allows", "");
  }

  void read_event(std::size_t& at) {
    demand_short_header(at, at);
    const auto id = number<std::uint16_t>(at, "event");
    at += 2;
    const std::size_t size = std::string_view(bytes_).substr(at, kLongestName_bytes).find('\0');
    if (size == std::string_view::npos)
      refuse_at(log_.path, at, "event", "", "its name is not terminated", "");
    const std::string name = bytes_.substr(at, size);
    at += size + 1;
    const std::size_t num_variables = number<std::uint16_t>(at, "event");
    at += 2;
    UsdVariables variables;
    for (std::size_t i = 0; i < num_variables; ++i) {
      const std::size_t before = at;
      variables.read(bytes_, log_.path, '\0', at);
      demand_short_header(before, at);
    }
    if (event_of(id) < events_.size())
      refuse_at(log_.path, at, "event", std::to_string(id), "is declared twice", "");
    log_.topics.push_back(variables.topic(name));
    events_.emplace_back(id, std::move(variables));
  }

  void read_records(std::size_t begin) {
    LogHealth& health = log_.health;
    if (bytes_.size() < begin + kChecksum_bytes) {
      health.checksum_failed = health.truncated = true;
      return;
    }
    std::size_t largest = 0;  // record
    for (const auto& [id, variables] : events_)
      largest = std::max(largest, head_bytes() + variables.record_bytes + kChecksum_bytes);
    double last_time = -1;
    const auto size_at = [&](std::size_t at, bool searching) {
      return searching ? size_after_damage(at, last_time) : record_size(at, last_time);
    };
    const auto ends_early = [&](std::size_t at) { return bytes_.size() - at < largest; };
    const std::size_t end = bytes_.size() - kChecksum_bytes;
    read_between_damage(begin, end, health, size_at, ends_early, [&](std::size_t at) {
      const std::size_t event = event_of(*integer_at<std::uint16_t>(bytes_, at));
      last_time = time_of(at);
      log_.topics[event].time_s.push_back(last_time / 1e6);
      events_[event].second.add_record(&bytes_[at] + head_bytes(), log_.topics[event]);
    });
    health.checksum_failed = *integer_at<std::uint32_t>(bytes_, end) != crc32_of({bytes_.data(), end});
  }

  /// Returns an index into events_; its size if the event is unknown.
  std::size_t event_of(std::size_t id) const {
    std::size_t index = 0;
    while (index < events_.size() && events_[index].first != id) ++index;
    return index;
  }

  std::size_t head_bytes() const { return is_in_ms_ ? 2 + 4 : 2 + 8; }
  /// Returns the time in microseconds.
  double time_of(std::size_t at) const {
    return is_in_ms_ ? 1000.0 * *integer_at<std::uint32_t>(bytes_, at + 2)
                     : static_cast<double>(*integer_at<std::uint64_t>(bytes_, at + 2));
  }

  /// Returns the size in bytes of the record at `at`; 0 without a known event and plausible time.
  std::size_t record_size(std::size_t at, double last_time) const {
    if (at > bytes_.size() || bytes_.size() - at < head_bytes()) return 0;
    const std::size_t event = event_of(*integer_at<std::uint16_t>(bytes_, at));
    if (event == events_.size()) return 0;
    const double time = time_of(at);
    if (last_time >= 0 && !(time >= last_time && time < last_time + kLater_us)) return 0;
    const std::size_t size = head_bytes() + events_[event].second.record_bytes;
    return bytes_.size() - at < size + kChecksum_bytes ? 0 : size;
  }

  std::size_t size_after_damage(std::size_t at, double last_time) const {
    constexpr int kRecords = 3;
    const std::size_t first = record_size(at, last_time);
    for (int i = 0; i < kRecords; ++i) {
      const std::size_t size = record_size(at, last_time);
      if (size == 0) return 0;
      last_time = time_of(at);
      at += size;
    }
    return first;
  }

  const std::string& bytes_;
  RawLog log_;
  bool is_in_ms_ = false;
  std::vector<std::pair<std::size_t, UsdVariables>> events_;
};

bool has_events(std::string_view head) {
  return head.size() >= 3 && static_cast<unsigned char>(head[0]) == 0xBC && head[2] == 0;
}

}  // namespace

/// An old log starts with the number of variables and "name(type),", which may look like text. "Time (s),X (m)" of a
/// CSV is not such a list: names contain no blanks, and "s" is not a type.
bool looks_like_usd(std::string_view head) {
  head = head.substr(0, 80);
  const std::size_t bracket = head.find('(');
  return has_events(head) ||
         (bracket != std::string_view::npos && bracket >= 2 && bracket + 3 < head.size() &&
          head[bracket + 2] == ')' && head[bracket + 3] == ',' &&
          kUsdTypes.find(head[bracket + 1]) != std::string_view::npos && head[bracket - 1] != ' ');
}

RawLog read_usd(std::string& bytes, const std::string& path) {
  RawLog log = has_events(bytes) ? EventReader(bytes, path).read() : read_blocks(bytes, path);
  log.path = path;
  return log;
}

}  // namespace swarmcert::logs
