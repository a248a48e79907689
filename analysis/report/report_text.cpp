#include "analysis/report/report_text.h"

#include <openssl/evp.h>

#include <nlohmann/json.hpp>

namespace swarmcert::analysis {
namespace {

constexpr const char* kReplacement = "\xEF\xBF\xBD";

bool is_control(char c) {
  const auto byte = static_cast<unsigned char>(c);
  return byte < 0x20 || byte == 0x7F;
}

/// Returns `text` with every byte replaced that is not part of valid UTF-8.
std::string valid_utf8(const std::string& text) {
  const std::string quoted =
      nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  return nlohmann::json::parse(quoted).get<std::string>();
}

/// Returns valid UTF-8 without its middle part if it is longer than gnuplot can place next to a plot.
std::string shortened(const std::string& text) {
  constexpr std::size_t kEnd = 13;
  std::vector<std::size_t> begins;
  for (std::size_t i = 0; i < text.size(); ++i)
    if ((static_cast<unsigned char>(text[i]) & 0xC0) != 0x80) begins.push_back(i);
  if (begins.size() <= 2 * kEnd + 1) return text;
  return text.substr(0, begins[kEnd]) + "\xE2\x80\xA6" + text.substr(begins[begins.size() - kEnd]);
}

}  // namespace

std::string html_text(const std::string& text) {
  std::string result;
  for (const char c : valid_utf8(text)) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      case '\'':
        result += "&#39;";
        break;
      case '\n':
      case '\t':
        result += c;
        break;
      default:
        if (is_control(c)) {
          result += kReplacement;
        } else {
          result += c;
        }
    }
  }
  return result;
}

std::string script_json(std::string json) {
  for (std::size_t at = json.find('<'); at != std::string::npos; at = json.find('<', at))
    json.replace(at, 1, "\\u003c");
  return json;
}

std::string plot_field(const std::string& text) {
  std::string result = "\"";
  for (const char c : shortened(valid_utf8(text)))
    result += c == '"' ? std::string("'") : c == '\\' ? "/" : is_control(c) ? " " : std::string(1, c);
  return result + "\"";
}

std::string plot_string(const std::string& text) {
  std::string result = "'";
  for (const char c : valid_utf8(text))
    result += c == '\'' ? std::string("\xE2\x80\x99") : is_control(c) ? " " : std::string(1, c);
  return result + "'";
}

std::string base64(std::string_view bytes) {
  std::string text(4 * ((bytes.size() + 2) / 3) + 1, '\0');
  text.resize(static_cast<std::size_t>(EVP_EncodeBlock(reinterpret_cast<unsigned char*>(text.data()),
                                                       reinterpret_cast<const unsigned char*>(bytes.data()),
                                                       static_cast<int>(bytes.size()))));
  return text;
}

std::string shell_line(const std::vector<std::string>& words) {
  constexpr const char* kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_@%+=:,./-";
  std::string line;
  for (const std::string& word : words) {
    if (!line.empty()) line += ' ';
    if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos) {
      line += word;
      continue;
    }
    line += '\'';
    for (const char c : word) line += c == '\'' ? std::string("'\\''") : std::string(1, c);
    line += '\'';
  }
  return line;
}

}  // namespace swarmcert::analysis
