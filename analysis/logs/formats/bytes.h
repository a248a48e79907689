/// @file What the readers of binary logs share: the whole file in memory, numbers of any type and byte order, refusals.
#pragma once

#include <cstddef>
#include <cstdint>
#include <iosfwd>
#include <optional>
#include <string>
#include <string_view>

namespace swarmcert::logs {

/// Largest log that is taken into memory: 2 GiB, hours of everything that a flight controller logs.
inline constexpr std::size_t kLargestLog_bytes = std::size_t{2} << 30;
/// Arrays with more elements are no signals of a flight (images, point clouds, memory dumps): they give no columns.
inline constexpr std::size_t kMostElements = 256;
/// Columns of one topic.
inline constexpr std::size_t kMostColumns = 4096;

/// What is left of the stream.
/// @throws files::InputError if it cannot be read, is empty, or is larger than kLargestLog_bytes.
std::string read_all(std::istream& in, const std::string& path);

/// @throws files::InputError, always.
[[noreturn]] void refuse_at(const std::string& path, std::size_t offset, const std::string& field,
                            const std::string& value, const std::string& what, const std::string& hint);

/// Types of numbers that logs store.
enum class Scalar : unsigned char {
  kInt8,
  kUint8,
  kInt16,
  kUint16,
  kInt32,
  kUint32,
  kInt64,
  kUint64,
  kFloat,
  kDouble
};

std::size_t size_of(Scalar type);

/// The number at `bytes`, which need not be aligned. Integers beyond 2^53 are rounded.
double value_of(Scalar type, const char* bytes, bool is_big_endian = false);

/// The little-endian integer at `offset` of `bytes`; nothing if it does not lie within.
template <typename Integer>
std::optional<Integer> integer_at(std::string_view bytes, std::size_t offset) {
  if (offset > bytes.size() || bytes.size() - offset < sizeof(Integer)) return std::nullopt;
  std::uint64_t value = 0;
  for (std::size_t i = sizeof(Integer); i-- > 0;)
    value = value << 8 | static_cast<unsigned char>(bytes[offset + i]);
  return static_cast<Integer>(value);
}

/// `text` up to its first NUL.
std::string until_nul(std::string_view text);

/// True for a name as languages and message definitions have them: letter or underscore, then these and digits.
bool is_identifier(std::string_view text, std::size_t longest = 128);

}  // namespace swarmcert::logs
