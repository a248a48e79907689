/// @file rosbag2 in MCAP (`.mcap`).
///
/// Reads the topics of ROS 2 messages (encoding "cdr", definitions "ros2msg"). Times are the messages' log times, in
/// seconds since 1970 or on whatever clock the recorder used. Chunks may be uncompressed or compressed with zstd or
/// lz4. The summary section is not needed. A chunk with a wrong checksum is skipped and counted; of a truncated chunk,
/// the part before the cut is kept. Topics with other encodings are listed in `left_out`. If the records become
/// invalid, the reader searches for the next byte at which two valid records follow each other.
#include <fmt/core.h>

#include <algorithm>
#include <deque>
#include <map>
#include <memory>
#include <utility>

#include "analysis/logs/formats/bytes.h"
#include "analysis/logs/formats/decompress.h"
#include "analysis/logs/formats/formats.h"
#include "analysis/logs/formats/ros_topic.h"

namespace swarmcert::logs {
namespace {

constexpr std::string_view kMcapMagic = "\x89MCAP0\r\n";
constexpr std::size_t kMcapHead_bytes = 9;  ///< of a record: opcode and length

enum McapCode : unsigned char {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kMetadata = 0x0C,
  kDataEnd = 0x0F
};

struct McapRecord {
  unsigned char code = 0;
  std::string_view content;
};

/// Reads fields from the front of a record; once a field is missing, all later fields are empty.
class McapFields {
 public:
  explicit McapFields(std::string_view content) : rest_(content) {}

  template <typename Integer>
  Integer number() {
    const std::optional<Integer> value = integer_at<Integer>(rest_, 0);
    take(sizeof(Integer));
    return value.value_or(0);
  }
  /// Reads a length-prefixed text, or bytes whose length is stored as a `Length`.
  template <typename Length = std::uint32_t>
  std::string_view bytes() {
    return take(number<Length>());
  }
  std::string_view rest() const { return rest_; }
  bool is_sound() const { return is_sound_; }
  bool is_at_end() const { return is_sound_ && rest_.empty(); }

 private:
  std::string_view take(std::uint64_t size) {
    if (size > rest_.size()) {
      is_sound_ = false;
      rest_ = {};
      return {};
    }
    const std::string_view taken = rest_.substr(0, size);
    rest_.remove_prefix(size);
    return taken;
  }

  std::string_view rest_;
  bool is_sound_ = true;
};

struct McapChunk {
  std::uint64_t uncompressed_bytes = 0;
  std::uint32_t checksum = 0;  ///< 0: none
  std::string_view compression, records;
  std::uint64_t stated_bytes = 0;  ///< of `records`
  bool is_whole = true;            ///< false if the file ends within it
};

/// Returns the record that starts at `at`, valid or not; nothing if it extends beyond `bytes`.
std::optional<McapRecord> mcap_record_at(std::string_view bytes, std::size_t at) {
  if (at > bytes.size() || bytes.size() - at < kMcapHead_bytes) return std::nullopt;
  const std::uint64_t size = *integer_at<std::uint64_t>(bytes, at + 1);
  if (size > bytes.size() - at - kMcapHead_bytes) return std::nullopt;
  return McapRecord{static_cast<unsigned char>(bytes[at]), bytes.substr(at + kMcapHead_bytes, size)};
}

/// Returns true if the content has the form required by its opcode. Accepts unknown and private opcodes.
bool has_mcap_form(const McapRecord& record) {
  // Bytes of integers; s: a text or bytes, S: with a length of 8 bytes; *: more may follow.
  static const std::map<unsigned char, std::string_view> forms = {
      {kHeader, "ss*"},   {kFooter, "884"},      {kSchema, "2sss"}, {kChannel, "22sss"}, {kMessage, "2488*"},
      {kChunk, "8884sS"}, {kMessageIndex, "2s"}, {kMetadata, "ss"}, {kDataEnd, "4"}};
  const auto form = forms.find(record.code);
  if (form == forms.end()) return record.code != 0;
  McapFields fields(record.content);
  for (const char part : form->second) {
    if (part == '*') return fields.is_sound();
    if (part == 's') fields.bytes();
    if (part == 'S') fields.bytes<std::uint64_t>();
    if (part == '2') fields.number<std::uint16_t>();
    if (part == '4') fields.number<std::uint32_t>();
    if (part == '8') fields.number<std::uint64_t>();
  }
  return fields.is_at_end();
}

/// Returns the chunk in the content of a record, which may be truncated.
McapChunk chunk_of(std::string_view content) {
  McapFields fields(content);
  McapChunk chunk;
  fields.number<std::uint64_t>();
  fields.number<std::uint64_t>();
  chunk.uncompressed_bytes = fields.number<std::uint64_t>();
  chunk.checksum = fields.number<std::uint32_t>();
  chunk.compression = fields.bytes();
  chunk.stated_bytes = fields.number<std::uint64_t>();
  chunk.is_whole = fields.is_sound() && chunk.stated_bytes <= fields.rest().size();
  chunk.records = fields.rest().substr(0, chunk.stated_bytes);
  return chunk;
}

std::size_t size_of(const McapRecord& record) { return kMcapHead_bytes + record.content.size(); }

constexpr std::size_t kLongestMcapName = 1024;

struct McapSchema {
  std::string name, encoding;
  std::string_view text;
};
struct McapChannel {
  std::uint16_t schema = 0;
  std::string topic, encoding;
};
class McapReader {
 public:
  McapReader(std::string_view bytes, const std::string& path) : bytes_(bytes) {
    log_.path = path;
    log_.format = "mcap";
    decompression_left_ = decompression_limit(bytes.size());
  }

  RawLog read() {
    if (!looks_like_mcap(bytes_))
      refuse_at(log_.path, 0, "magic number", "", "is not that of an MCAP file", "is this a rosbag?");
    const std::vector<std::size_t> records = find_records();
    // Definitions first: if the chunk that holds them is damaged, the summary at the end of the file repeats them.
    for (const std::size_t at : records) take_definition(*mcap_record_at(bytes_, at));
    for (const std::size_t at : records) take_top(at);
    if (cut_chunk_) take_chunk(*cut_chunk_, *cut_offset_);
    finish();
    return std::move(log_);
  }

 private:
  /// Returns the offsets of the valid records outside chunks and counts damage.
  std::vector<std::size_t> find_records() {
    std::vector<std::size_t> found;
    std::size_t at = kMcapMagic.size();
    while (at < bytes_.size()) {
      if (bytes_.substr(at) == kMcapMagic) return found;
      const std::optional<McapRecord> record = mcap_record_at(bytes_, at);
      if (record && has_mcap_form(*record)) {
        found.push_back(at);
        at += size_of(*record);
        continue;
      }
      if (!record && keep_cut_chunk(at)) break;
      const std::size_t next = next_sound(at);
      log_.health.skipped_bytes += next - at;
      if (next < bytes_.size()) ++log_.health.damaged_blocks;
      at = next;
    }
    log_.health.truncated = true;  // a complete file ends with the magic number
    return found;
  }

  /// Returns the next byte from which two valid records follow each other; the end of the file if there is none.
  std::size_t next_sound(std::size_t at) const {
    for (++at; at < bytes_.size(); ++at) {
      if (bytes_.substr(at) == kMcapMagic) return at;
      const std::optional<McapRecord> first = mcap_record_at(bytes_, at);
      if (!first || first->code > kDataEnd || !has_mcap_form(*first)) continue;
      const std::size_t behind = at + size_of(*first);
      const std::optional<McapRecord> second = mcap_record_at(bytes_, behind);
      if (second && second->code <= kDataEnd && has_mcap_form(*second)) return at;
      if (bytes_.substr(behind) == kMcapMagic) return at;
    }
    return bytes_.size();
  }

  /// Keeps the chunk at `at` if the file ends within it, i.e. if its two stated sizes agree and exceed what is left.
  /// Returns false otherwise.
  bool keep_cut_chunk(std::size_t at) {
    if (bytes_.size() - at < kMcapHead_bytes || static_cast<unsigned char>(bytes_[at]) != kChunk)
      return false;
    const std::string_view content = bytes_.substr(at + kMcapHead_bytes);
    const McapChunk chunk = chunk_of(content);
    const std::size_t fields_bytes = content.size() - chunk.records.size();
    const auto size = *integer_at<std::uint64_t>(bytes_, at + 1);
    if (chunk.is_whole || size < fields_bytes || size - fields_bytes != chunk.stated_bytes) return false;
    cut_chunk_ = chunk;
    cut_offset_ = at;
    return true;
  }

  void take_definition(const McapRecord& record) {
    if (record.code == kSchema) take_schema(record.content);
    if (record.code == kChannel) take_channel(record.content);
  }

  void take_schema(std::string_view content) {
    McapFields fields(content);
    const auto id = fields.number<std::uint16_t>();
    McapSchema schema;
    schema.name = fields.bytes();
    schema.encoding = fields.bytes();
    schema.text = fields.bytes();
    if (!fields.is_sound() || id == 0) return;
    // The text must outlive its chunk; definitions are repeated in every chunk, so only one copy is kept.
    if (schemas_.count(id) > 0 || schema.text.size() > kLongestDefinition_bytes ||
        schema.name.size() > kLongestMcapName)
      return;
    texts_.emplace_back(schema.text);
    schema.text = texts_.back();
    schemas_.emplace(id, std::move(schema));
  }

  void take_channel(std::string_view content) {
    McapFields fields(content);
    const auto id = fields.number<std::uint16_t>();
    McapChannel channel;
    channel.schema = fields.number<std::uint16_t>();
    channel.topic = fields.bytes();
    channel.encoding = fields.bytes();
    if (fields.is_sound() && channel.topic.size() <= kLongestMcapName)
      channels_.emplace(id, std::move(channel));
  }

  void take_top(std::size_t at) {
    const McapRecord record = *mcap_record_at(bytes_, at);
    if (record.code == kMessage) take_message(record.content);
    if (record.code == kChunk) take_chunk(chunk_of(record.content), at);
    // Only the first end of data is checked: a malicious file could contain many.
    if (record.code != kDataEnd || std::exchange(is_past_data_end_, true)) return;
    const std::uint32_t stored = *integer_at<std::uint32_t>(record.content, 0);
    if (stored != 0 && stored != crc32_of(bytes_.substr(0, at))) log_.health.checksum_failed = true;
  }

  void take_chunk(const McapChunk& chunk, std::size_t at) {
    const std::map<std::string_view, Compression> known = {
        {"", Compression::kNone}, {"zstd", Compression::kZstd}, {"lz4", Compression::kLz4}};
    const auto compression = known.find(chunk.compression);
    if (compression == known.end())
      return log_.left_out.push_back(
          {fmt::format("chunk at offset {}", at),
           fmt::format("compression \"{}\" is not known; supported are zstd and lz4",
                       chunk.compression.substr(0, 64)),
           0});
    const std::size_t limit = std::min<std::uint64_t>(decompression_left_, chunk.uncompressed_bytes);
    const Decompressed content = decompress(compression->second, chunk.records, limit);
    decompression_left_ -= std::min(decompression_left_, content.bytes.size());
    bool is_sound_chunk = content.is_whole && content.bytes.size() == chunk.uncompressed_bytes;
    if (is_sound_chunk && chunk.checksum != 0) is_sound_chunk = crc32_of(content.bytes) == chunk.checksum;
    if (chunk.is_whole && !is_sound_chunk) {
      ++log_.health.damaged_blocks;
      log_.health.skipped_bytes += chunk.records.size();
      log_.left_out.push_back({fmt::format("chunk at offset {}", at),
                               content.is_too_large ? "it is larger than stated, or too large for a flight"
                                                    : "its checksum is wrong, or it cannot be decompressed",
                               0});
      return;
    }
    take_records(content.bytes, chunk.is_whole);
  }

  /// Reads the records within a chunk.
  void take_records(std::string_view content, bool is_whole) {
    std::size_t at = 0;
    while (at < content.size()) {
      const std::optional<McapRecord> record = mcap_record_at(content, at);
      if (!record || !has_mcap_form(*record)) {
        if (is_whole) ++log_.health.damaged_blocks;
        log_.health.skipped_bytes += content.size() - at;
        return;
      }
      take_definition(*record);
      if (record->code == kMessage) take_message(record->content);
      at += size_of(*record);
    }
  }

  void take_message(std::string_view content) {
    McapFields fields(content);
    const auto id = fields.number<std::uint16_t>();
    fields.number<std::uint32_t>();
    const auto time_ns = fields.number<std::uint64_t>();
    fields.number<std::uint64_t>();
    auto found = topics_.find(id);
    if (found == topics_.end()) {
      if (channels_.count(id) == 0) {
        ++unknown_channels_[id];
        return;
      }
      found = topics_.emplace(id, begin_topic(channels_.at(id))).first;
    }
    if (found->second.topic)
      found->second.topic->add(static_cast<double>(time_ns) / 1e9, fields.rest());
    else
      ++found->second.lost;
  }

  FoundTopic begin_topic(const McapChannel& channel) {
    const auto schema = schemas_.find(channel.schema);
    if (schema == schemas_.end() && channel.encoding == "cdr")
      return {std::nullopt, channel.topic, "the file lost the definition of its messages"};
    const McapSchema used = schema == schemas_.end() ? McapSchema() : schema->second;
    return found_topic(channel.topic, channel.encoding, used.name,
                       used.encoding == "ros2msg" ? used.text : "", budget_);
  }

  void finish() {
    for (auto& [id, topic] : topics_) topic.move_to(log_, fmt::format("channel {}", id));
    number_instances(log_);
    for (const auto& [id, lost] : unknown_channels_)
      log_.left_out.push_back(
          {fmt::format("channel {}", id), "the file lost the record that names its topic", lost});
  }

  const std::string_view bytes_;
  RawLog log_;
  RosBudget budget_;
  bool is_past_data_end_ = false;
  std::size_t decompression_left_ = 0;
  std::deque<std::string> texts_;  ///< of schemas; views of them stay valid
  std::map<std::uint16_t, McapSchema> schemas_;
  std::map<std::uint16_t, McapChannel> channels_;
  std::map<std::uint16_t, FoundTopic> topics_;
  std::map<std::uint16_t, std::size_t> unknown_channels_;
  std::optional<McapChunk> cut_chunk_;
  std::optional<std::size_t> cut_offset_;
};

}  // namespace

bool looks_like_mcap(std::string_view head) { return head.substr(0, kMcapMagic.size()) == kMcapMagic; }

RawLog read_mcap(std::string& bytes, const std::string& path) { return McapReader(bytes, path).read(); }

}  // namespace swarmcert::logs
