#include "analysis/logs/formats/ulog_messages.h"

#include <fmt/core.h>

#include <map>

#include "analysis/logs/formats/bytes.h"

namespace swarmcert::logs {
namespace {

constexpr std::string_view kSyncMagic = "\x2F\x73\x13\x20\x25\x0C\xBB\x12";
constexpr std::size_t kLongestName = 256;
constexpr std::size_t kParameter_bytes = 4;

/// Number types of information messages by name.
const std::map<std::string, Scalar>& number_types() {
  static const std::map<std::string, Scalar> types = {
      {"int8_t", Scalar::kInt8},     {"uint8_t", Scalar::kUint8},   {"bool", Scalar::kUint8},
      {"int16_t", Scalar::kInt16},   {"uint16_t", Scalar::kUint16}, {"int32_t", Scalar::kInt32},
      {"uint32_t", Scalar::kUint32}, {"int64_t", Scalar::kInt64},   {"uint64_t", Scalar::kUint64},
      {"float", Scalar::kFloat},     {"double", Scalar::kDouble}};
  return types;
}

}  // namespace

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

bool value_size_fits(const KeyedValue& entry) {
  const auto number = number_types().find(entry.type);
  if (number != number_types().end()) return entry.value.size() == size_of(number->second);
  if (entry.type.compare(0, 5, "char[") != 0) return true;
  return entry.type == "char[" + std::to_string(entry.value.size()) + "]";
}

std::optional<double> parameter_of(const KeyedValue& entry) {
  if (entry.value.size() != kParameter_bytes) return std::nullopt;
  if (entry.type == "int32_t") return value_of(Scalar::kInt32, entry.value.data());
  if (entry.type == "float") return value_of(Scalar::kFloat, entry.value.data());
  return std::nullopt;
}

std::string text_of(const KeyedValue& entry) {
  if (entry.type == "uint64_t" && entry.value.size() == 8)
    return std::to_string(*integer_at<std::uint64_t>(entry.value, 0));
  if (entry.type == "int64_t" && entry.value.size() == 8)
    return std::to_string(*integer_at<std::int64_t>(entry.value, 0));
  const auto number = number_types().find(entry.type);
  if (number != number_types().end() && entry.value.size() == size_of(number->second))
    return fmt::format("{}", value_of(number->second, entry.value.data()));
  return until_nul(entry.value);
}

bool has_form(const UlogMessage& message) {
  const std::string_view body = message.body;
  const auto has_key = [&](std::size_t at) {
    return body.size() > at + 1 && is_identifier(body.substr(at + 1, 1)) && keyed_value(body.substr(at));
  };
  switch (message.type) {
    case 'B':
      return body.size() >= 40;
    case 'F':
      return is_identifier(body.substr(0, 1)) &&
             body.substr(0, kLongestName).find(':') != std::string_view::npos;
    case 'I':
      return has_key(0);
    case 'P':
      return has_key(0) && body.size() == 1 + kParameter_bytes + static_cast<unsigned char>(body[0]);
    case 'M':
      return !body.empty() && (body[0] == 0 || body[0] == 1) && has_key(1);
    case 'Q':
      return has_key(1) && body.size() == 2 + kParameter_bytes + static_cast<unsigned char>(body[1]);
    case 'A':
      return body.size() >= 4 && is_identifier(body.substr(3), kLongestName);
    case 'R':
    case 'O':
      return body.size() == 2;
    case 'L':
      return body.size() >= 9;
    case 'C':
      return body.size() >= 11;
    case 'S':
      return body == kSyncMagic;
    default:
      return false;
  }
}

}  // namespace swarmcert::logs
