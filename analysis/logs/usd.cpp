#include <zlib.h>

#include <algorithm>

#include "analysis/logs/byte_window.h"
#include "analysis/logs/record_source.h"
#include "nn/base/input_error.h"

namespace swarmcert::logs {
namespace {

constexpr std::size_t kLongestName_bytes = 64;
constexpr std::size_t kChecksum_bytes = 4;

[[noreturn]] void refuse(const std::string& path, std::size_t offset, const std::string& field,
                         const std::string& value, const std::string& what, const std::string& hint) {
  throw files::InputError({path, "offset " + std::to_string(offset), field, value, what, hint});
}

std::uint32_t checksum(const unsigned char* bytes, std::size_t size, std::uint32_t before = 0) {
  return static_cast<std::uint32_t>(crc32(before, bytes, static_cast<uInt>(size)));
}

struct UsdHeader {
  std::vector<std::string> names;
  std::vector<BinaryVariable> variables;
  std::size_t record_bytes = 0;

  void add(const std::string& path, std::size_t offset, const std::string& name, char type) {
    if (size_of(type) == 0) {
      refuse(path, offset, name, files::in_quotes(std::string(1, type)), "is not a known type",
             "supported are b B h H i I f");
    }
    if (std::find(names.begin(), names.end(), name) != names.end())
      refuse(path, offset, name, "", "is named twice", "log each variable once");
    names.push_back(name);
    variables.push_back({type, record_bytes});
    record_bytes += size_of(type);
  }
};

/// Reads "name(type)", terminated by `end`. The name must not contain control characters.
void read_token(ByteWindow& window, const std::string& path, char end, std::uint32_t* sum,
                UsdHeader& header) {
  const std::size_t start = window.offset();
  const std::size_t size = window.left(kLongestName_bytes);
  const auto* const bytes = size > 0 ? window.peek(size) : nullptr;
  const auto* const found =
      bytes == nullptr ? nullptr : static_cast<const unsigned char*>(std::memchr(bytes, end, size));
  const std::string token = found == nullptr ? ""
                                             : std::string(reinterpret_cast<const char*>(bytes),
                                                           static_cast<std::size_t>(found - bytes));
  const bool is_token = token.size() >= 4 && token[token.size() - 3] == '(' && token.back() == ')' &&
                        std::all_of(token.begin(), token.end(), [](char c) { return c > ' ' && c < 127; });
  if (!is_token) {
    refuse(path, start, "variable " + std::to_string(header.names.size() + 1), files::in_quotes(token),
           "is not of the form name(type)", "is this a micro-SD log?");
  }
  header.add(path, start, token.substr(0, token.size() - 3), token[token.size() - 2]);
  if (sum != nullptr) *sum = checksum(bytes, token.size() + 1, *sum);
  window.skip(token.size() + 1);
}

void decode(const UsdHeader& header, const unsigned char* record, double* values) {
  for (std::size_t i = 0; i < header.variables.size(); ++i)
    values[i] = value_of(header.variables[i].type, record + header.variables[i].offset);
}

/// Finds valid blocks of the old format.
class Blocks {
 public:
  Blocks(ByteWindow& window, const UsdHeader& header) : window_(window), header_(header) {}

  /// Returns the size in bytes of the valid block that starts here; 0 if there is none.
  std::size_t sound_block() {
    const unsigned char* const count = window_.peek(1);
    if (count == nullptr) return 0;
    const std::size_t body = 1 + *count * header_.record_bytes;
    const unsigned char* const block = window_.peek(body + kChecksum_bytes);
    if (block == nullptr) return 0;
    work_bytes_ += body;
    // The writers in use store NOT CRC-32.
    return little_endian<std::uint32_t>(block + body) == ~checksum(block, body) ? body + kChecksum_bytes : 0;
  }

  /// Returns whether the block that is announced here ends within the file.
  bool fits() {
    const std::size_t size = 1 + *window_.peek(1) * header_.record_bytes + kChecksum_bytes;
    return window_.left(size) == size;
  }

  /// Returns true if a block may start here after damage: it is not empty and its first time is soon after `last`. This
  /// avoids computing a checksum at almost every byte; an empty block is only five bytes, which occur by chance.
  bool may_start(std::uint32_t last) {
    const unsigned char* const bytes = window_.peek(1 + header_.record_bytes);
    if (bytes == nullptr || *bytes == 0) return false;
    if (header_.variables[0].type != 'I') return true;
    constexpr std::uint32_t kLater_us = 600'000'000;
    return little_endian<std::uint32_t>(bytes + 1) - last < kLater_us;
  }

  std::size_t work_bytes() const { return work_bytes_; }

 private:
  ByteWindow& window_;
  const UsdHeader& header_;
  std::size_t work_bytes_ = 0;
};

}  // namespace

void read_usd(std::istream& in, const std::string& path, RecordSink& sink, LogHealth& health) {
  ByteWindow window(in);
  const unsigned char* const first = window.peek(1);
  if (first == nullptr)
    refuse(path, 0, "", "", "the file is empty", "the recording failed; exclude this file");
  const std::size_t num_variables = *first;
  if (num_variables == 0) refuse(path, 0, "number of variables", "0", "no variable was logged", "");
  std::uint32_t sum = checksum(first, 1);
  window.skip(1);
  UsdHeader header;
  while (header.names.size() < num_variables) read_token(window, path, ',', &sum, header);
  const unsigned char* const stored = window.peek(kChecksum_bytes);
  if (stored == nullptr) refuse(path, window.offset(), "header", "", "the file ends inside the header", "");
  if (little_endian<std::uint32_t>(stored) != ~sum)
    refuse(path, window.offset(), "header", "", "its checksum is wrong", "copy the file again from the card");
  window.skip(kChecksum_bytes);
  sink.begin(header.names);

  Blocks blocks(window, header);
  std::vector<double> values(num_variables);
  std::uint32_t last_time = 0;
  bool searching = false, is_cut = false;
  // Limits the work on malicious files, which could request a checksum over thousands of bytes at each byte.
  constexpr std::size_t kMostSearch_bytes = std::size_t{4} << 30;
  while (window.left(1) == 1) {
    const bool tries = !searching || (blocks.work_bytes() < kMostSearch_bytes && blocks.may_start(last_time));
    const std::size_t size = tries ? blocks.sound_block() : 0;
    if (size == 0) {
      if (!searching) is_cut = !blocks.fits();
      health.damaged_blocks += searching ? 0 : 1;
      ++health.skipped_bytes;
      searching = true;
      window.skip(1);
      continue;
    }
    searching = false;
    ++health.blocks;
    const unsigned char* const block = window.peek(size);
    for (std::size_t i = 0; i < block[0]; ++i) {
      decode(header, block + 1 + i * header.record_bytes, values.data());
      last_time = static_cast<std::uint32_t>(values[0]);
      sink.record(values);
    }
    window.skip(size);
  }
  health.truncated = searching;
  health.damaged_blocks -= searching && is_cut ? 1 : 0;
}

namespace {

struct Event {
  UsdHeader header;
  std::string name;
};

class EventReader {
 public:
  EventReader(std::istream& in, const std::string& path) : window_(in), path_(path) {}

  /// @return the version
  int read_header() {
    const unsigned char* const head = peek(5, "header");
    version_ = little_endian<std::uint16_t>(head + 1);
    if (version_ != 1 && version_ != 2)
      refuse(path_, 1, "version", std::to_string(version_), "is not known", "supported are 1 and 2");
    const std::size_t num_events = little_endian<std::uint16_t>(head + 3);
    sum(head, 5);
    for (std::size_t i = 0; i < num_events; ++i) read_event();
    if (events_.empty()) refuse(path_, 3, "number of events", "0", "nothing was logged", "");
    return version_;
  }

  void read_records(RawLog& log) {
    LogHealth& health = log.health;
    for (const auto& [id, event] : events_) {
      RawTopic topic;
      topic.name = event.name;
      for (const std::string& name : event.header.names) topic.columns.push_back({name, "", {}});
      log.topics.push_back(std::move(topic));
    }
    std::size_t largest = 0;  // record
    for (const auto& [id, event] : events_)
      largest = std::max(largest, head_bytes() + event.header.record_bytes + kChecksum_bytes);
    std::vector<double> values;
    bool searching = false, is_cut = false;
    double last_time = -1;
    while (window_.left(kChecksum_bytes + 1) > kChecksum_bytes) {
      const std::size_t size = searching ? after_damage(last_time) : record_size(0, last_time);
      if (size == 0) {
        if (!searching) is_cut = window_.left(largest) < largest;
        health.damaged_blocks += searching ? 0 : 1;
        ++health.skipped_bytes;
        searching = true;
        sum(window_.peek(1), 1);
        continue;
      }
      searching = false;
      const unsigned char* const record = window_.peek(size);
      const std::size_t index = event_of(little_endian<std::uint16_t>(record));
      const UsdHeader& header = events_[index].second.header;
      RawTopic& topic = log.topics[index];
      last_time = time_of(record);
      values.resize(header.variables.size());
      decode(header, record + head_bytes(), values.data());
      topic.time_s.push_back(last_time / 1e6);
      for (std::size_t k = 0; k < values.size(); ++k) topic.columns[k].values.push_back(values[k]);
      sum(window_.peek(size), size);
    }
    health.truncated = searching;
    health.damaged_blocks -= searching && is_cut ? 1 : 0;
    const unsigned char* const stored = window_.peek(kChecksum_bytes);
    health.checksum_failed = stored == nullptr || little_endian<std::uint32_t>(stored) != checksum_;
    if (stored == nullptr) health.truncated = true;
  }

 private:
  const unsigned char* peek(std::size_t size, const std::string& field) {
    const unsigned char* const bytes = window_.peek(size);
    if (bytes == nullptr) refuse(path_, window_.offset(), field, "", "the file ends inside the header", "");
    return bytes;
  }
  void sum(const unsigned char* bytes, std::size_t size) {
    checksum_ = checksum(bytes, size, checksum_);
    window_.skip(size);
  }

  void read_event() {
    if (window_.offset() > kLargestHeader_bytes)
      refuse(path_, window_.offset(), "header", "", "is longer than the firmware allows", "");
    const std::size_t id = little_endian<std::uint16_t>(peek(2, "event"));
    sum(peek(2, "event"), 2);
    const std::size_t size = window_.left(kLongestName_bytes);
    const unsigned char* const name = peek(size, "event");
    const auto* const end = static_cast<const unsigned char*>(std::memchr(name, 0, size));
    if (end == nullptr) refuse(path_, window_.offset(), "event", "", "its name is not terminated", "");
    Event event;
    event.name.assign(name, end);
    sum(name, static_cast<std::size_t>(end - name) + 1);
    const std::size_t num_variables = little_endian<std::uint16_t>(peek(2, "event"));
    sum(peek(2, "event"), 2);
    for (std::size_t i = 0; i < num_variables; ++i) {
      const std::size_t before = window_.offset();
      read_token(window_, path_, '\0', &checksum_, event.header);
      if (window_.offset() > kLargestHeader_bytes) {
        refuse(path_, before, "header", "", "is longer than the firmware allows", "");
      }
    }
    for (const auto& [other, unused] : events_) {
      if (other == id) refuse(path_, window_.offset(), "event", std::to_string(id), "is declared twice", "");
    }
    events_.emplace_back(id, std::move(event));
  }

  /// Returns an index into events_; its size if the event is unknown.
  std::size_t event_of(std::size_t id) const {
    std::size_t index = 0;
    while (index < events_.size() && events_[index].first != id) ++index;
    return index;
  }

  std::size_t head_bytes() const { return version_ == 1 ? 2 + 4 : 2 + 8; }
  /// Returns the time in microseconds.
  double time_of(const unsigned char* record) const {
    return version_ == 1 ? 1000.0 * little_endian<std::uint32_t>(record + 2)
                         : static_cast<double>(little_endian<std::uint64_t>(record + 2));
  }

  /// Returns the size in bytes of the record `ahead` bytes from here; 0 without a known event and plausible time.
  std::size_t record_size(std::size_t ahead, double last_time) {
    const unsigned char* const head = window_.peek(ahead + head_bytes());
    if (head == nullptr) return 0;
    const std::size_t index = event_of(little_endian<std::uint16_t>(head + ahead));
    if (index == events_.size()) return 0;
    constexpr double kLater_us = 600e6;
    const double time = time_of(head + ahead);
    if (last_time >= 0 && !(time >= last_time && time < last_time + kLater_us)) return 0;
    const std::size_t size = head_bytes() + events_[index].second.header.record_bytes;
    return window_.peek(ahead + size + kChecksum_bytes) == nullptr ? 0 : size;
  }

  std::size_t after_damage(double last_time) {
    constexpr int kRecords = 3;
    std::size_t ahead = 0, first = 0;
    for (int i = 0; i < kRecords; ++i) {
      const std::size_t size = record_size(ahead, last_time);
      if (size == 0) return 0;
      if (i == 0) first = size;
      last_time = time_of(window_.peek(ahead + head_bytes()) + ahead);
      ahead += size;
    }
    return first;
  }

  static constexpr std::size_t kLargestHeader_bytes = std::size_t{1} << 16;
  ByteWindow window_;
  const std::string path_;
  int version_ = 0;
  std::uint32_t checksum_ = 0;
  std::vector<std::pair<std::size_t, Event>> events_;
};

}  // namespace

int read_usd_events(std::istream& in, const std::string& path, RawLog& log) {
  EventReader reader(in, path);
  const int version = reader.read_header();
  reader.read_records(log);
  return version;
}

}  // namespace swarmcert::logs
