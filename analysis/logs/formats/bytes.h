/// @file Helpers of the binary readers: whole files in memory, numbers of any type and byte order, errors.
#pragma once

#include <cstddef>
#include <cstdint>
#include <iosfwd>
#include <optional>
#include <string>
#include <string_view>

namespace swarmcert::logs {

/// Largest log that is read into memory: 2 GiB, i.e. hours of everything a flight controller can log.
inline constexpr std::size_t kLargestLog_bytes = std::size_t{2} << 30;
/// Larger arrays are not flight signals (images, point clouds, memory dumps) and are not turned into columns.
inline constexpr std::size_t kMostElements = 256;
/// Largest number of columns of a topic.
inline constexpr std::size_t kMostColumns = 4096;

/// Returns the rest of the stream.
/// @throws files::InputError if it cannot be read, is empty, or is larger than kLargestLog_bytes.
std::string read_all(std::istream& in, const std::string& path);

/// Always throws.
/// @throws files::InputError with the given parts.
[[noreturn]] void refuse_at(const std::string& path, std::size_t offset, const std::string& field,
                            const std::string& value, const std::string& what, const std::string& hint);

/// Number types that occur in logs.
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

/// Returns the type with this letter in Python's struct module: b B h H i I q Q f d.
std::optional<Scalar> scalar_of_letter(char letter);

/// Returns the type called "int8", ..., "uint64", "float", "double".
std::optional<Scalar> scalar_called(std::string_view name);

/// Returns the number at `bytes`, which need not be aligned. Integers above 2^53 are rounded.
double value_of(Scalar type, const char* bytes, bool is_big_endian = false);

/// Returns the little-endian integer at `offset` of `bytes`; nothing if it extends beyond the end.
template <typename Integer>
std::optional<Integer> integer_at(std::string_view bytes, std::size_t offset) {
  if (offset > bytes.size() || bytes.size() - offset < sizeof(Integer)) return std::nullopt;
  std::uint64_t value = 0;
  for (std::size_t i = sizeof(Integer); i-- > 0;)
    value = value << 8 | static_cast<unsigned char>(bytes[offset + i]);
  return static_cast<Integer>(value);
}

/// Returns the CRC-32 of `bytes`.
std::uint32_t crc32_of(std::string_view bytes);

/// Returns `text` up to its first NUL.
std::string until_nul(std::string_view text);

/// Returns true for an identifier: a letter or underscore, followed by letters, digits and underscores.
bool is_identifier(std::string_view text, std::size_t longest = 128);

}  // namespace swarmcert::logs
