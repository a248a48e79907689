#include "analysis/gate/text.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>
#include <vector>

#include "nn/base/json.h"

namespace swarmcert::gate {
namespace {

/// Whether XML and terminals take no such character: controls, and what stands for bytes that are no UTF-8.
bool is_unprintable(std::string_view character) {
  const auto first = static_cast<unsigned char>(character[0]);
  if (character.size() == 1) return first < 0x20 || first == 0x7f;
  return (character.size() == 2 && first == 0xc2 && static_cast<unsigned char>(character[1]) < 0xa0) ||
         character == "\xEF\xBF\xBD" || character == "\xEF\xBF\xBE" || character == "\xEF\xBF\xBF";
}

using Replacements = std::vector<std::pair<char, const char*>>;

std::string escaped(const std::string& text, const Replacements& replacements) {
  std::string result;
  for (const char c : text) {
    const auto found = std::find_if(replacements.begin(), replacements.end(),
                                    [c](const auto& one) { return one.first == c; });
    result += found == replacements.end() ? std::string(1, c) : found->second;
  }
  return result;
}

}  // namespace

std::string printable(const std::string& text) {
  using files::Json;
  const auto valid =
      Json::parse(Json(text).dump(-1, ' ', false, Json::error_handler_t::replace)).get<std::string>();
  std::string result;
  for (std::size_t at = 0, end = 0; at < valid.size(); at = end) {
    for (end = at + 1; end < valid.size() && (static_cast<unsigned char>(valid[end]) & 0xc0u) == 0x80;) ++end;
    const std::string_view character(valid.data() + at, end - at);
    result += is_unprintable(character) ? "?" : character;
  }
  return result;
}

std::string xml(const std::string& text) {
  return escaped(printable(text),
                 {{'&', "&amp;"}, {'<', "&lt;"}, {'>', "&gt;"}, {'"', "&quot;"}, {'\'', "&apos;"}});
}

std::string markdown(const std::string& text) {
  std::string result;
  for (const char c : printable(text)) {
    if (c == '<') {
      result += "&lt;";
    } else if (c == '&') {
      result += "&amp;";
    } else if (std::string("\\`*_{}[]()#!|>~@").find(c) != std::string::npos) {
      result += '\\';
      result += c;
    } else {
      result += c;
    }
  }
  return result;
}

std::string github(const std::string& text, bool is_property) {
  std::string lines;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find_first_of("\r\n", at), text.size());
    lines += printable(text.substr(at, end - at));
    if (end < text.size()) lines += text[end];
    at = end + 1;
  }
  Replacements replacements = {{'%', "%25"}, {'\r', "%0D"}, {'\n', "%0A"}};
  if (is_property) replacements.insert(replacements.end(), {{':', "%3A"}, {',', "%2C"}});
  return escaped(lines, replacements);
}

std::string uri(const std::string& path) {
  std::string result = !path.empty() && path[0] == '/' ? "file://" : "";
  for (const char c : path) {
    const bool is_plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                          std::string("-._~/").find(c) != std::string::npos;
    if (is_plain) {
      result += c;
    } else {
      result += fmt::format("%{:02X}", static_cast<unsigned>(static_cast<unsigned char>(c)));
    }
  }
  return result;
}

std::string number(const std::optional<double>& value) {
  if (!value) return "-";
  return std::isfinite(*value) ? fmt::format("{:.6g}", *value) : "not finite";
}

}  // namespace swarmcert::gate
