/// @file PX4 ULog (`.ulg`), file format versions 0 and 1.
///
/// Reads a log. Topics are identified by name and instance (multi_id); times come from their field `timestamp`.
/// Parameters are those at the start of the log. A topic whose subscription or format is lost is listed in `left_out`.
/// Messages of unknown types are skipped, as the format requires. If no valid message follows, the reader searches for
/// the next valid message that is followed by others, and counts the damaged place and the skipped bytes in `health`.
/// Sections appended after a crash are read as well.
#include <fmt/core.h>

#include <algorithm>

#include "analysis/logs/formats/bytes.h"
#include "analysis/logs/formats/formats.h"
#include "analysis/logs/formats/ulog_formats.h"
#include "nn/base/input_error.h"

namespace swarmcert::logs {
namespace {

/// The message types known to this reader.
constexpr std::string_view kUlogTypes = "ABCDFILMOPQRS";

/// A message: its type and body.
struct UlogMessage {
  char type;
  std::string_view body;
};

/// A key "type name" and the bytes that follow it, as in information and parameter messages.
struct KeyedValue {
  std::string type, name;
  std::string_view value;
};

constexpr std::string_view kSyncMagic = "\x2F\x73\x13\x20\x25\x0C\xBB\x12";
constexpr std::size_t kLongestName = 256;
constexpr std::size_t kParameter_bytes = 4;

/// Splits `body` into key and value; returns nothing if it has no such key.
std::optional<KeyedValue> keyed_value(std::string_view body) {
  if (body.empty()) return std::nullopt;
  const std::size_t length = static_cast<unsigned char>(body[0]);
  if (length == 0 || length > body.size() - 1) return std::nullopt;
  const std::string_view key = body.substr(1, length);
  const std::size_t blank = key.find(' ');
  if (blank == std::string_view::npos) return std::nullopt;
  return KeyedValue{std::string(key.substr(0, blank)), std::string(key.substr(blank + 1)),
                    body.substr(1 + length)};
}

/// Returns true if the value has the size that its type requires, or if the type is unknown.
bool value_size_fits(const KeyedValue& entry) {
  if (const std::optional<Scalar> number = ulog_number(entry.type))
    return entry.value.size() == size_of(*number);
  if (entry.type.compare(0, 5, "char[") != 0) return true;
  return entry.type == "char[" + std::to_string(entry.value.size()) + "]";
}

/// Returns the value of a parameter; nothing if it is neither an int32_t nor a float.
std::optional<double> parameter_of(const KeyedValue& entry) {
  if (entry.value.size() != kParameter_bytes) return std::nullopt;
  if (entry.type == "int32_t") return value_of(Scalar::kInt32, entry.value.data());
  if (entry.type == "float") return value_of(Scalar::kFloat, entry.value.data());
  return std::nullopt;
}

/// Returns true if the body has the form required by its type; false for data ('D'), whose form is defined in the file,
/// and for unknown types. Looks at only a few bytes.
bool has_form(const UlogMessage& message) {
  const std::string_view body = message.body;
  const auto has_key = [&](std::size_t at) {
    return body.size() > at + 1 && is_identifier(body.substr(at + 1, 1)) && keyed_value(body.substr(at));
  };
  const char type = message.type;
  if (type == 'F')
    return is_identifier(body.substr(0, 1)) &&
           body.substr(0, kLongestName).find(':') != std::string_view::npos;
  if (type == 'P')
    return has_key(0) && body.size() == 1 + kParameter_bytes + static_cast<unsigned char>(body[0]);
  if (type == 'Q')
    return has_key(1) && body.size() == 2 + kParameter_bytes + static_cast<unsigned char>(body[1]);
  if (type == 'M') return !body.empty() && (body[0] == 0 || body[0] == 1) && has_key(1);
  if (type == 'A') return body.size() >= 4 && is_identifier(body.substr(3), kLongestName);
  if (type == 'I') return has_key(0);
  if (type == 'R' || type == 'O') return body.size() == 2;
  if (type == 'S') return body == kSyncMagic;
  const std::size_t least = type == 'B' ? 40 : type == 'L' ? 9 : type == 'C' ? 11 : SIZE_MAX;
  return body.size() >= least;
}

constexpr std::string_view kUlogMagic = "ULog\x01\x12\x35";
constexpr std::size_t kFileHead_bytes = 16;
constexpr std::size_t kMessageHead_bytes = 3;
constexpr std::size_t kMostAppended = 3;
constexpr std::size_t kMostLooks = 64;

class UlogReader {
 public:
  UlogReader(std::string_view bytes, const std::string& path) : bytes_(bytes) {
    log_.path = path;
    log_.format = "ulog";
  }

  RawLog read() {
    read_file_head();
    std::vector<std::size_t> ends = read_flags();
    ends.push_back(bytes_.size());
    std::size_t begin = kFileHead_bytes;
    for (const std::size_t end : ends) {
      read_section(begin, end, end == bytes_.size());
      begin = end;
    }
    for (const auto& [what, records] : left_out_) log_.left_out.push_back({what.first, what.second, records});
    return std::move(log_);
  }

 private:
  struct Subscription {
    std::string name;
    int instance = 0;
    std::optional<UlogSize> size;      ///< of a record; set once its format is known
    std::optional<std::size_t> topic;  ///< index in topics_, set by its first record
  };
  struct Topic {
    UlogLayout layout;
    std::size_t index;  ///< index in log_.topics
  };

  void read_file_head() {
    if (!looks_like_ulog(bytes_))
      refuse_at(log_.path, 0, "magic number", "", "is not that of a ULog file", "is this a PX4 log?");
    if (bytes_.size() < kFileHead_bytes)
      refuse_at(log_.path, bytes_.size(), "file head", "", "the file ends inside it", files::kCopyAgain);
    const int version = static_cast<unsigned char>(bytes_[7]);
    if (version > 1)
      refuse_at(log_.path, 7, "version", std::to_string(version), "is not known", "supported are 0 and 1");
  }

  /// Returns the offsets of appended sections in ascending order.
  /// @throws files::InputError if the file uses incompatible features.
  std::vector<std::size_t> read_flags() {
    std::vector<std::size_t> offsets;
    const std::optional<UlogMessage> flags = message_at(kFileHead_bytes, bytes_.size());
    if (!flags || flags->type != 'B' || flags->body.size() < 40) return offsets;
    for (std::size_t i = 0; i < 8; ++i) {
      const int unknown = static_cast<unsigned char>(flags->body[8 + i]) & (i == 0 ? 0xFE : 0xFF);
      if (unknown != 0) {
        refuse_at(log_.path, kFileHead_bytes + kMessageHead_bytes + 8 + i, "incompatible flags",
                  fmt::format("{:#04x}", unknown), "announce a feature that this reader does not know",
                  "convert the log with the tools of the firmware that wrote it");
      }
    }
    if ((flags->body[8] & 1) == 0) return offsets;
    for (std::size_t i = 0; i < kMostAppended; ++i) {
      const std::uint64_t offset = *integer_at<std::uint64_t>(flags->body, 16 + 8 * i);
      if (offset == 0) continue;
      const std::size_t last = offsets.empty() ? kFileHead_bytes : offsets.back();
      if (offset >= bytes_.size())
        log_.health.truncated = true;
      else if (offset <= last)
        ++log_.health.damaged_blocks;
      else
        offsets.push_back(offset);
    }
    return offsets;
  }

  /// Returns the message that starts at `at` and ends before `end`, valid or not.
  std::optional<UlogMessage> message_at(std::size_t at, std::size_t end) const {
    if (at > end || end - at < kMessageHead_bytes) return std::nullopt;
    const std::size_t size = *integer_at<std::uint16_t>(bytes_, at);
    if (size > end - at - kMessageHead_bytes) return std::nullopt;
    return UlogMessage{bytes_[at + 2], bytes_.substr(at + kMessageHead_bytes, size)};
  }
  static std::size_t size_of(const UlogMessage& message) { return kMessageHead_bytes + message.body.size(); }

  /// Returns true if the body has the form required by its type or, for data, if it is a record of a known topic. Looks
  /// at only a few bytes.
  bool is_sound(const UlogMessage& message) {
    return message.type == 'D' ? record_size_fits(message.body) : has_form(message);
  }

  /// Returns false if the text of a message contains binary bytes: then its size is damaged and it would swallow what
  /// follows. Precondition: is_sound(message).
  bool ends_where_it_says(const UlogMessage& message) {
    std::string_view text;
    if (message.type == 'F') text = message.body;
    if (message.type == 'L') text = message.body.substr(9);
    if (message.type == 'C') text = message.body.substr(11);
    if (message.type == 'I') return value_size_fits(*keyed_value(message.body));
    if (message.type == 'M') return value_size_fits(*keyed_value(message.body.substr(1)));
    // Limits the work on malicious files, which could request a long scan at each byte.
    if (looked_at_bytes_ > kMostLooks * bytes_.size()) return true;
    looked_at_bytes_ += text.size();
    while (!text.empty() && text.back() == '\0') text.remove_suffix(1);
    const auto is_binary = [](char c) {
      return static_cast<unsigned char>(c) < ' ' && (c < '\t' || c > '\r') && c != '\x1b';
    };
    return std::none_of(text.begin(), text.end(), is_binary);
  }

  bool record_size_fits(std::string_view body) {
    if (body.size() < 2) return false;
    const auto found = subscriptions_.find(*integer_at<std::uint16_t>(body, 0));
    if (found == subscriptions_.end()) return false;
    std::optional<UlogSize>& size = found->second.size;
    if (!size) size = formats_.size(found->second.name);
    return size && body.size() - 2 >= size->smallest && body.size() - 2 <= size->largest;
  }

  /// Returns true if a valid message starts at `at` that is a synchronisation message or is followed by two more.
  bool is_resynchronised(std::size_t at, std::size_t end) {
    const std::optional<UlogMessage> message = message_at(at, end);
    if (!message || !is_sound(*message)) return false;
    const std::size_t next = at + size_of(*message);
    return message->type == 'S' || (next < end && leads_on(next, end, 2));
  }

  /// Returns true if a chain of messages starting at `at`, including unknown types and topics, contains `sound` valid
  /// ones or reaches the end of the section.
  bool leads_on(std::size_t at, std::size_t end, int sound) {
    constexpr int kMostMessages = 64;
    for (int i = 0; i < kMostMessages && at < end && sound > 0; ++i) {
      const std::optional<UlogMessage> message = message_at(at, end);
      if (!message || message->body.empty()) return false;
      if (is_sound(*message)) --sound;
      at += size_of(*message);
    }
    return at == end || sound == 0;
  }

  void read_section(std::size_t at, std::size_t end, bool is_last) {
    while (at < end) {
      const std::optional<UlogMessage> message = message_at(at, end);
      if (message && is_sound(*message) && ends_where_it_says(*message)) {
        take(*message);
        at += size_of(*message);
        continue;
      }
      if (message && is_unknown(*message) && leads_on(at + size_of(*message), end, 3)) {
        leave_out(*message);
        at += size_of(*message);
        continue;
      }
      std::size_t next = at + 1;
      while (next < end && !is_resynchronised(next, end)) ++next;
      log_.health.skipped_bytes += next - at;
      // The last message of a file, or before an appended section, was being written when the vehicle stopped.
      if (next < end || message) ++log_.health.damaged_blocks;
      if (next == end && is_last) log_.health.truncated = true;
      at = next;
    }
  }

  /// Returns true for messages that are valid but cannot be used: those of later versions, and records whose topic or
  /// format is not defined in the file.
  bool is_unknown(const UlogMessage& message) const {
    if (message.body.empty()) return false;
    if (message.type != 'D') return kUlogTypes.find(message.type) == std::string_view::npos;
    const std::optional<std::uint16_t> id = integer_at<std::uint16_t>(message.body, 0);
    const auto found = id ? subscriptions_.find(*id) : subscriptions_.end();
    return id && (found == subscriptions_.end() || !found->second.size);
  }

  /// Precondition: is_unknown(message).
  void leave_out(const UlogMessage& message) {
    if (message.type != 'D') {
      ++left_out_[{fmt::format("message type {:#04x}", static_cast<unsigned char>(message.type)),
                   "is not known"}];
      return;
    }
    const std::uint16_t id = *integer_at<std::uint16_t>(message.body, 0);
    const auto found = subscriptions_.find(id);
    if (found == subscriptions_.end())
      ++left_out_[{fmt::format("message id {}", id), "the file lost the message that names its topic"}];
    else
      ++left_out_[{found->second.name, "its format, or one that it uses, is not defined in the file"}];
  }

  void take(const UlogMessage& message) {
    const std::string_view body = message.body;
    if (message.type == 'F' && !formats_.add(body)) ++log_.health.damaged_blocks;
    if (message.type == 'P') take_parameter(body);
    if (message.type == 'A') subscribe(body);
    if (message.type == 'R') subscriptions_.erase(*integer_at<std::uint16_t>(body, 0));
    if (message.type == 'D') take_record(body);
    if (message.type == 'O') log_.health.dropouts_s += *integer_at<std::uint16_t>(body, 0) / 1e3;
    // Flags, information, texts, defaults and synchronisation hold no signals.
  }

  void take_parameter(std::string_view body) {
    const std::optional<KeyedValue> entry = keyed_value(body);
    const std::optional<double> value = entry ? parameter_of(*entry) : std::nullopt;
    if (!value)
      ++log_.health.damaged_blocks;
    else if (log_.health.records == 0)
      log_.parameters[entry->name] = *value;
  }

  void subscribe(std::string_view body) {
    Subscription subscription;
    subscription.instance = static_cast<unsigned char>(body[0]);
    subscription.name = until_nul(body.substr(3));
    subscriptions_[*integer_at<std::uint16_t>(body, 1)] = subscription;
  }

  Topic& topic_of(Subscription& subscription) {
    if (!subscription.topic) {
      const auto [found, is_new] =
          topics_of_.emplace(std::pair{subscription.name, subscription.instance}, topics_.size());
      if (is_new) begin_topic(subscription);
      subscription.topic = found->second;
    }
    return topics_[*subscription.topic];
  }

  void begin_topic(const Subscription& subscription) {
    Topic topic{formats_.layout(subscription.name), log_.topics.size()};
    const UlogLayout& layout = topic.layout;
    for (const std::string& name : layout.large_arrays)
      log_.left_out.push_back(
          {subscription.name + "." + name, fmt::format("it has more than {} elements", kMostElements), 0});
    if (layout.has_too_many_columns)
      log_.left_out.push_back(
          {subscription.name, fmt::format("only its first {} numbers are kept", kMostColumns), 0});
    if (!layout.timestamp) log_.left_out.push_back({subscription.name, "it has no field \"timestamp\"", 0});
    RawTopic raw;
    raw.name = raw.type = subscription.name;
    raw.instance = subscription.instance;
    for (const UlogNumber& number : layout.numbers) raw.columns.push_back({number.name, {}});
    if (layout.timestamp) log_.topics.push_back(std::move(raw));
    topics_.push_back(std::move(topic));
  }

  /// Precondition: record_size_fits(body).
  void take_record(std::string_view body) {
    const Topic& topic = topic_of(subscriptions_.at(*integer_at<std::uint16_t>(body, 0)));
    const UlogLayout& layout = topic.layout;
    if (!layout.timestamp) return;
    const char* const record = body.data() + 2;
    RawTopic& raw = log_.topics[topic.index];
    raw.time_s.push_back(value_of(layout.timestamp->type, record + layout.timestamp->offset) / 1e6);
    for (std::size_t i = 0; i < layout.numbers.size(); ++i) {
      const UlogNumber& number = layout.numbers[i];
      raw.columns[i].values.push_back(value_of(number.type, record + number.offset));
    }
    ++log_.health.records;
  }

  const std::string_view bytes_;
  RawLog log_;
  UlogFormats formats_;
  std::map<std::uint16_t, Subscription> subscriptions_;
  std::vector<Topic> topics_;
  std::map<std::pair<std::string, int>, std::size_t> topics_of_;         ///< index in topics_
  std::map<std::pair<std::string, std::string>, std::size_t> left_out_;  ///< records by name and reason
  std::size_t looked_at_bytes_ = 0;
};

}  // namespace

bool looks_like_ulog(std::string_view head) { return head.substr(0, kUlogMagic.size()) == kUlogMagic; }

RawLog read_ulog(std::string& bytes, const std::string& path) { return UlogReader(bytes, path).read(); }

}  // namespace swarmcert::logs
