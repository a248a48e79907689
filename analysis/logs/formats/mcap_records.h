/// @file Records of an MCAP file: framing, fields, checksums.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "analysis/logs/formats/bytes.h"

namespace swarmcert::logs {

inline constexpr std::string_view kMcapMagic = "\x89MCAP0\r\n";
inline constexpr std::size_t kMcapHead_bytes = 9;  ///< of a record: opcode and length

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
std::optional<McapRecord> mcap_record_at(std::string_view bytes, std::size_t at);

inline std::size_t size_of(const McapRecord& record) { return kMcapHead_bytes + record.content.size(); }

/// Returns true if the content has the form required by its opcode. Accepts unknown and private opcodes.
bool has_form(const McapRecord& record);

/// Returns the chunk in the content of a record, which may be truncated.
McapChunk chunk_of(std::string_view content);

/// Returns the CRC-32 of `bytes`.
std::uint32_t mcap_checksum(std::string_view bytes);

}  // namespace swarmcert::logs
