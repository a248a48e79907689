#include "analysis/logs/formats/mcap_records.h"

#include <zlib.h>

namespace swarmcert::logs {

std::optional<McapRecord> mcap_record_at(std::string_view bytes, std::size_t at) {
  if (at > bytes.size() || bytes.size() - at < kMcapHead_bytes) return std::nullopt;
  const std::uint64_t size = *integer_at<std::uint64_t>(bytes, at + 1);
  if (size > bytes.size() - at - kMcapHead_bytes) return std::nullopt;
  return McapRecord{static_cast<unsigned char>(bytes[at]), bytes.substr(at + kMcapHead_bytes, size)};
}

bool has_form(const McapRecord& record) {
  McapFields fields(record.content);
  switch (record.code) {
    case 0:
      return false;
    case kHeader:
      fields.bytes();
      fields.bytes();
      return fields.is_sound();
    case kFooter:
      return record.content.size() == 20;
    case kSchema:
      fields.number<std::uint16_t>();
      fields.bytes();
      fields.bytes();
      fields.bytes();
      return fields.is_at_end();
    case kChannel:
      fields.number<std::uint16_t>();
      fields.number<std::uint16_t>();
      fields.bytes();
      fields.bytes();
      fields.bytes();
      return fields.is_at_end();
    case kMessage:
      return record.content.size() >= 22;
    case kChunk:
      fields.number<std::uint64_t>();
      fields.number<std::uint64_t>();
      fields.number<std::uint64_t>();
      fields.number<std::uint32_t>();
      fields.bytes();
      fields.bytes<std::uint64_t>();
      return fields.is_at_end();
    case kMessageIndex:
      fields.number<std::uint16_t>();
      fields.bytes();
      return fields.is_at_end();
    case kMetadata:
      fields.bytes();
      fields.bytes();
      return fields.is_at_end();
    case kDataEnd:
      return record.content.size() == 4;
    default:
      return true;
  }
}

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

std::uint32_t mcap_checksum(std::string_view bytes) {
  uLong sum = 0;
  constexpr std::size_t kPart_bytes = std::size_t{1} << 30;  // zlib uses 32-bit sizes
  for (std::size_t at = 0; at < bytes.size(); at += kPart_bytes) {
    const std::string_view part = bytes.substr(at, kPart_bytes);
    sum = crc32(sum, reinterpret_cast<const Bytef*>(part.data()), static_cast<uInt>(part.size()));
  }
  return static_cast<std::uint32_t>(sum);
}

}  // namespace swarmcert::logs
