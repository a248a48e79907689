/// @file Field-by-field decoding of serialized ROS 2 messages (CDR).
#pragma once

#include <string_view>

#include "analysis/logs/formats/bytes.h"

namespace swarmcert::logs {

/// A cursor in serialized data. Numbers are aligned to their size, relative to the end of the 4-byte header.
class CdrCursor {
 public:
  /// Returns false if the header announces an unknown encoding.
  bool begin(std::string_view message) {
    if (message.size() < 4 || message[0] != 0) return false;
    const auto encoding = static_cast<unsigned char>(message[1]);
    if (encoding != 0 && encoding != 1 && encoding != 6 && encoding != 7) return false;
    is_big_endian_ = encoding % 2 == 0;
    largest_alignment_ = encoding < 2 ? 8 : 4;
    data_ = message.substr(4);
    at_ = 0;
    return true;
  }

  std::size_t left() const { return data_.size() - at_; }

  bool read(Scalar type, double& value) {
    const std::size_t size = size_of(type);
    if (!align(size) || left() < size) return false;
    value = value_of(type, data_.data() + at_, is_big_endian_);
    at_ += size;
    return true;
  }
  bool read_count(std::size_t& count) {
    double value = 0;
    if (!read(Scalar::kUint32, value)) return false;
    count = static_cast<std::size_t>(value);
    return true;
  }
  bool read_text(std::string_view& text) {
    std::size_t size = 0;
    if (!read_count(size) || left() < size) return false;
    text = data_.substr(at_, size);
    while (!text.empty() && text.back() == '\0') text.remove_suffix(1);
    at_ += size;
    return true;
  }
  /// Skips `count` numbers.
  bool skip(Scalar type, std::size_t count) {
    if (count == 0) return true;
    const std::size_t size = size_of(type);
    if (!align(size) || left() / size < count) return false;
    at_ += count * size;
    return true;
  }

 private:
  bool align(std::size_t size) {
    const std::size_t alignment = size < largest_alignment_ ? size : largest_alignment_;
    const std::size_t excess = at_ % alignment;
    if (excess == 0) return true;
    if (left() < alignment - excess) return false;
    at_ += alignment - excess;
    return true;
  }

  std::string_view data_;
  std::size_t at_ = 0, largest_alignment_ = 8;
  bool is_big_endian_ = false;
};

}  // namespace swarmcert::logs
