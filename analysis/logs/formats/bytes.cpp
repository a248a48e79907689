#include "analysis/logs/formats/bytes.h"

#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <istream>
#include <iterator>

#include "nn/base/input_error.h"

namespace swarmcert::logs {
namespace {

template <typename Number>
double number_at(const char* bytes, bool is_big_endian) {
  unsigned char ordered[sizeof(Number)];
  std::memcpy(ordered, bytes, sizeof(Number));
  constexpr bool kHostIsBigEndian = __BYTE_ORDER__ == __ORDER_BIG_ENDIAN__;
  if (is_big_endian != kHostIsBigEndian) std::reverse(ordered, ordered + sizeof(Number));
  Number number;
  std::memcpy(&number, ordered, sizeof(Number));
  return static_cast<double>(number);
}

}  // namespace

std::string read_all(std::istream& in, const std::string& path) {
  constexpr std::size_t kLargestChunk_bytes = std::size_t{4} << 20;
  std::size_t chunk_bytes = std::size_t{1} << 14;
  std::string bytes;
  while (in) {
    const std::size_t before = bytes.size();
    if (before > kLargestLog_bytes)
      refuse_at(path, before, "", "", "the log is larger than 2 GiB", "cut it, or log fewer topics");
    bytes.resize(before + chunk_bytes);
    in.read(bytes.data() + before, static_cast<std::streamsize>(chunk_bytes));
    bytes.resize(before + static_cast<std::size_t>(in.gcount()));
    chunk_bytes = std::min(2 * chunk_bytes, kLargestChunk_bytes);
  }
  if (in.bad()) refuse_at(path, bytes.size(), "", "", "cannot be read", "check its permissions and the disk");
  if (bytes.empty())
    refuse_at(path, 0, "", "", "the file is empty", "the recording failed; exclude this file");
  return bytes;
}

void refuse_at(const std::string& path, std::size_t offset, const std::string& field,
               const std::string& value, const std::string& what, const std::string& hint) {
  throw files::InputError({path, "offset " + std::to_string(offset), field, value, what, hint});
}

std::size_t size_of(Scalar type) {
  constexpr std::size_t sizes[] = {1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
  return sizes[static_cast<std::size_t>(type)];
}

std::optional<Scalar> scalar_of_letter(char letter) {
  const std::size_t at = std::string_view("bBhHiIqQfd").find(letter);
  return at == std::string_view::npos ? std::nullopt : std::optional(static_cast<Scalar>(at));
}

std::optional<Scalar> scalar_called(std::string_view name) {
  constexpr std::string_view names[] = {"int8",   "uint8", "int16",  "uint16", "int32",
                                        "uint32", "int64", "uint64", "float",  "double"};
  const auto* const found = std::find(std::begin(names), std::end(names), name);
  return found == std::end(names) ? std::nullopt : std::optional(static_cast<Scalar>(found - names));
}

double value_of(Scalar type, const char* bytes, bool is_big_endian) {
  constexpr double (*read[])(const char*, bool) = {
      number_at<std::int8_t>,  number_at<std::uint8_t>,  number_at<std::int16_t>, number_at<std::uint16_t>,
      number_at<std::int32_t>, number_at<std::uint32_t>, number_at<std::int64_t>, number_at<std::uint64_t>,
      number_at<float>,        number_at<double>};
  return read[static_cast<std::size_t>(type)](bytes, is_big_endian);
}

std::uint32_t crc32_of(std::string_view bytes) {
  uLong sum = 0;
  constexpr std::size_t kPart_bytes = std::size_t{1} << 30;  // zlib uses 32-bit sizes
  for (std::size_t at = 0; at < bytes.size(); at += kPart_bytes) {
    const std::string_view part = bytes.substr(at, kPart_bytes);
    sum = crc32(sum, reinterpret_cast<const Bytef*>(part.data()), static_cast<uInt>(part.size()));
  }
  return static_cast<std::uint32_t>(sum);
}

std::string until_nul(std::string_view text) { return std::string(text.substr(0, text.find('\0'))); }

bool is_identifier(std::string_view text, std::size_t longest) {
  const auto is_letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; };
  const auto is_part = [&](char c) { return is_letter(c) || (c >= '0' && c <= '9'); };
  return !text.empty() && text.size() <= longest && is_letter(text[0]) &&
         std::all_of(text.begin(), text.end(), is_part);
}

}  // namespace swarmcert::logs
