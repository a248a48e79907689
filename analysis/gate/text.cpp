#include "analysis/gate/text.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

namespace swarmcert::gate {
namespace {

/// Returns the number of bytes of the UTF-8 sequence (RFC 3629) that starts at `at`; 0 if there is none.
std::size_t sequence(const std::string& text, std::size_t at) {
  const auto byte = [&](std::size_t i) -> unsigned {
    return at + i < text.size() ? static_cast<unsigned char>(text[at + i]) : 0u;
  };
  const unsigned first = byte(0);
  if (first < 0x80) return 1;
  const std::size_t size = first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : 2;
  if (first < 0xc2 || first > 0xf4) return 0;
  unsigned code = first & (0x7fu >> size);
  for (std::size_t i = 1; i < size; ++i) {
    if ((byte(i) & 0xc0u) != 0x80) return 0;
    code = code << 6 | (byte(i) & 0x3fu);
  }
  const unsigned least = size == 4 ? 0x10000 : size == 3 ? 0x800 : 0x80;
  const bool is_sound = code >= least && code <= 0x10ffff && !(code >= 0xd800 && code < 0xe000) &&
                        code != 0xfffe && code != 0xffff;
  return is_sound ? size : 0;
}

/// Replaces every character by the result of `escape`; nullptr keeps the character.
template <class Escape>
std::string escaped(const std::string& text, const Escape& escape) {
  std::string result;
  for (const char c : text) {
    if (const char* const replacement = escape(c)) {
      result += replacement;
    } else {
      result += c;
    }
  }
  return result;
}

}  // namespace

std::string printable(const std::string& text) {
  std::string result;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t size = sequence(text, at);
    const auto c = static_cast<unsigned char>(text[at]);
    const bool is_control = size == 1
                                ? c < 0x20 || c == 0x7f
                                : size == 2 && c == 0xc2 && static_cast<unsigned char>(text[at + 1]) < 0xa0;
    if (size == 0 || is_control) {
      result += '?';
    } else {
      result.append(text, at, size);
    }
    at += size == 0 ? 1 : size;
  }
  return result;
}

std::string xml(const std::string& text) {
  return escaped(printable(text), [](char c) -> const char* {
    switch (c) {
      case '&':
        return "&amp;";
      case '<':
        return "&lt;";
      case '>':
        return "&gt;";
      case '"':
        return "&quot;";
      case '\'':
        return "&apos;";
      default:
        return nullptr;
    }
  });
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
  return escaped(lines, [is_property](char c) -> const char* {
    switch (c) {
      case '%':
        return "%25";
      case '\r':
        return "%0D";
      case '\n':
        return "%0A";
      case ':':
        return is_property ? "%3A" : nullptr;
      case ',':
        return is_property ? "%2C" : nullptr;
      default:
        return nullptr;
    }
  });
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
