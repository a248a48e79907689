/// @file A sliding window over a byte stream, and little-endian numbers.
#pragma once

#include <cstdint>
#include <cstring>
#include <istream>
#include <vector>

namespace swarmcert::logs {

/// Reads a stream no further ahead than requested. Offsets count from the stream position at construction.
class ByteWindow {
 public:
  explicit ByteWindow(std::istream& in) : in_(in) {}

  /// Returns the next `size` bytes without consuming them, nullptr if the stream ends first. Valid until the next call.
  const unsigned char* peek(std::size_t size) {
    fill(size);
    return available() >= size ? buffer_.data() + begin_ : nullptr;
  }
  /// Returns the number of bytes left, but at most `limit`.
  std::size_t left(std::size_t limit) {
    fill(limit);
    return available() < limit ? available() : limit;
  }
  /// Precondition: `size` bytes have been peeked.
  void skip(std::size_t size) {
    begin_ += size;
    offset_ += size;
  }
  std::size_t offset() const { return offset_; }

 private:
  std::size_t available() const { return end_ - begin_; }

  void fill(std::size_t size) {
    if (available() >= size) return;
    constexpr std::size_t kChunk_bytes = std::size_t{1} << 16;
    if (begin_ > 0) std::memmove(buffer_.data(), buffer_.data() + begin_, available());
    end_ -= begin_;
    begin_ = 0;
    while (end_ < size && in_) {
      if (buffer_.size() < end_ + kChunk_bytes) buffer_.resize(end_ + kChunk_bytes);
      in_.read(reinterpret_cast<char*>(buffer_.data()) + end_, static_cast<std::streamsize>(kChunk_bytes));
      end_ += static_cast<std::size_t>(in_.gcount());
    }
  }

  std::istream& in_;
  std::vector<unsigned char> buffer_;
  std::size_t begin_ = 0, end_ = 0, offset_ = 0;
};

/// Returns the little-endian number of type `Number` at `bytes`.
template <typename Number>
Number little_endian(const unsigned char* bytes) {
  unsigned char ordered[sizeof(Number)];
  std::memcpy(ordered, bytes, sizeof(Number));
#if __BYTE_ORDER__ == __ORDER_BIG_ENDIAN__
  for (std::size_t i = 0; i < sizeof(Number) / 2; ++i) std::swap(ordered[i], ordered[sizeof(Number) - 1 - i]);
#endif
  Number number;
  std::memcpy(&number, ordered, sizeof(Number));
  return number;
}

/// A variable of a binary log.
struct BinaryVariable {
  char type;           ///< as in Python's struct module: b B h H i I f
  std::size_t offset;  ///< within the record
};

/// Returns the size of a variable of `type` in bytes; 0 if the type is unknown.
inline std::size_t size_of(char type) {
  switch (type) {
    case 'b':
    case 'B':
      return 1;
    case 'h':
    case 'H':
      return 2;
    case 'i':
    case 'I':
    case 'f':
      return 4;
    default:
      return 0;
  }
}

inline double value_of(char type, const unsigned char* bytes) {
  switch (type) {
    case 'b':
      return little_endian<std::int8_t>(bytes);
    case 'B':
      return little_endian<std::uint8_t>(bytes);
    case 'h':
      return little_endian<std::int16_t>(bytes);
    case 'H':
      return little_endian<std::uint16_t>(bytes);
    case 'i':
      return little_endian<std::int32_t>(bytes);
    case 'I':
      return little_endian<std::uint32_t>(bytes);
    default:
      return static_cast<double>(little_endian<float>(bytes));
  }
}

}  // namespace swarmcert::logs
