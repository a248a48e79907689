#include "nn/base/toml.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <sstream>
#include <string_view>

#include "nn/base/input_error.h"
#include "nn/base/suggest.h"

namespace swarmcert::files {
namespace {

constexpr std::size_t kLargestToml_bytes = std::size_t{64} << 10;
/// Every dot of a key "a.b.c" opens a table, and toml++ destroys nested tables recursively: 30 000 overflow the stack.
/// Dots in numbers and file names are counted as well; our files contain a few hundred.
constexpr std::ptrdiff_t kMostDots = 4000;

/// Converts a document to ASCII. In toml++ 3.3, non-ASCII characters outside of quotes and comments reach a
/// __builtin_unreachable(), and for malformed text no simple rule agrees with toml++ on where quotes begin and end. The
/// parser therefore never gets non-ASCII characters: they become "\UXXXXXXXX" in double quotes and "?" in comments, and
/// are rejected elsewhere.
class AsciiWriter {
 public:
  AsciiWriter(const std::string& text, const std::string& path) : text_(text), path_(path) {}

  std::string run() {
    if (text_.compare(0, 3, "\xef\xbb\xbf") == 0) at_ = 3;  // a byte order mark
    char inside = '\0';                                     // the quote or '#' that opened this context
    while (at_ < text_.size()) {
      const char c = text_[at_];
      if (static_cast<unsigned char>(c) >= 0x80) {
        write_letter(inside);
        continue;
      }
      result_ += c;
      ++at_;
      if (inside == '"' && c == '\\' && at_ < text_.size() && static_cast<unsigned char>(text_[at_]) < 0x80) {
        result_ += text_[at_++];
      } else if (inside == '\0' && (c == '"' || c == '\'' || c == '#')) {
        inside = c;
      } else if (inside == '#' ? c == '\n' : c == inside) {
        inside = '\0';
      }
    }
    return result_;
  }

 private:
  void write_letter(char inside) {
    if (inside == '#') {
      result_ += '?';
      ++at_;
      return;
    }
    if (inside != '"') refuse("this character is allowed in double quotes only");
    char escape[16];
    std::snprintf(escape, sizeof escape, "\\U%08X", static_cast<unsigned>(code_point()));
    result_ += escape;
  }

  /// Reads one character of two to four bytes (RFC 3629).
  std::uint32_t code_point() {
    const auto byte = [this](std::size_t i) {
      return at_ + i < text_.size() ? static_cast<std::uint32_t>(static_cast<unsigned char>(text_[at_ + i]))
                                    : 0;
    };
    const std::uint32_t first = byte(0);
    const std::size_t size = first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : 2;
    std::uint32_t code = first & (0x7fu >> size);
    bool is_valid = first >= 0xc2 && first < 0xf5;
    for (std::size_t i = 1; i < size; ++i) {
      is_valid = is_valid && (byte(i) & 0xc0u) == 0x80;
      code = code << 6 | (byte(i) & 0x3fu);
    }
    const std::uint32_t least = size == 4 ? 0x10000 : size == 3 ? 0x800 : 0x80;
    if (!is_valid || code < least || code > 0x10ffff || (code >= 0xd800 && code < 0xe000))
      refuse("is not UTF-8");
    at_ += size;
    return code;
  }

  [[noreturn]] void refuse(const std::string& what) const {
    const std::string before = text_.substr(0, at_);
    const std::size_t newline = before.rfind('\n');  // npos + 1 is 0
    throw InputError({path_,
                      "line " + std::to_string(std::count(before.begin(), before.end(), '\n') + 1) +
                          ", column " + std::to_string(before.size() - (newline + 1) + 1),
                      "", "", "is not TOML (" + what + ")", ""});
  }

  const std::string& text_;
  const std::string& path_;
  std::size_t at_ = 0;
  std::string result_;
};

std::string line_words(const toml::source_region& source) {
  return source.begin.line == 0 ? "" : "line " + std::to_string(source.begin.line);
}

/// Returns the value as the user could have written it.
std::string text_of(const toml::node& node) {
  if (node.is_table()) return "a table";
  if (node.is_array()) return "a list";
  if (const auto* const string = node.as_string()) return in_quotes(string->get());
  std::ostringstream text;
  node.visit([&text](const auto& value) {
    if constexpr (toml::is_value<decltype(value)>) text << value;
  });
  return text.str();
}

}  // namespace

toml::table parse_toml(const std::string& text, const std::string& path) {
  if (text.size() > kLargestToml_bytes) throw InputError({path, "", "", "", "is larger than 64 KiB", ""});
  if (std::count(text.begin(), text.end(), '.') > kMostDots) {
    throw InputError({path, "", "", "", "has more than " + std::to_string(kMostDots) + " dots", ""});
  }
  const std::string ascii = AsciiWriter(text, path).run();
  try {
    return toml::parse(std::string_view(ascii), path);
  } catch (const toml::parse_error& error) {
    const toml::source_position& at = error.source().begin;
    throw InputError({path, "line " + std::to_string(at.line) + ", column " + std::to_string(at.column), "",
                      "", "is not TOML (" + std::string(error.description()) + ")", ""});
  }
}

void TomlTable::allow_only(const std::vector<std::string>& known) const {
  for (const auto& [key, node] : *table_) {
    const std::string name(key.str());
    if (std::find(known.begin(), known.end(), name) != known.end()) continue;
    throw InputError({path_, line_words(key.source()), prefix_ + name, "", "is not a known key",
                      did_you_mean(name, known)});
  }
}

void TomlTable::require_schema(const std::string& schema) const {
  if (const std::string stated = text("schema"); stated != schema)
    refuse("schema", in_quotes(stated), "must be " + in_quotes(schema), "is this the right file?");
}

int TomlTable::line(const std::string& key) const {
  const toml::node* const found = key.empty() ? table_ : table_->get(key);
  return found == nullptr ? 0 : static_cast<int>(found->source().begin.line);
}

std::vector<std::string> TomlTable::keys() const {
  std::vector<std::string> result;
  for (const auto& [key, node] : *table_) result.emplace_back(key.str());
  return result;
}

void TomlTable::refuse(const std::string& key, const std::string& value, const std::string& what,
                       const std::string& hint) const {
  const toml::node* const found = key.empty() ? table_ : table_->get(key);
  const std::string where = line_words((found == nullptr ? table_ : found)->source());
  std::string field = prefix_ + key;
  if (key.empty() && !field.empty()) field.pop_back();
  throw InputError({path_, where, field, value, what, hint});
}

const toml::node& TomlTable::node(const std::string& key) const {
  const toml::node* const found = table_->get(key);
  if (found == nullptr) refuse(key, "", "is missing");
  return *found;
}

std::string TomlTable::text(const std::string& key) const {
  const toml::node& found = node(key);
  if (!found.is_string()) refuse(key, text_of(found), "must be text in quotes");
  return found.as_string()->get();
}

double TomlTable::number(const std::string& key) const {
  const toml::node& found = node(key);
  if (!found.is_number()) refuse(key, text_of(found), "must be a number");
  const double number = *found.value<double>();
  if (!std::isfinite(number)) refuse(key, text_of(found), "must be finite");
  return number;
}

std::vector<double> TomlTable::numbers(const std::string& key) const {
  const toml::node& found = node(key);
  if (!found.is_array()) refuse(key, text_of(found), "must be a list of numbers");
  std::vector<double> result;
  for (const toml::node& item : *found.as_array()) {
    if (!item.is_number()) refuse(key, text_of(item), "must be a list of numbers");
    result.push_back(*item.value<double>());
    if (!std::isfinite(result.back())) refuse(key, text_of(item), "must be finite");
  }
  return result;
}

std::vector<std::string> TomlTable::texts(const std::string& key) const {
  const toml::node& found = node(key);
  if (!found.is_array()) refuse(key, text_of(found), "must be a list of texts in quotes");
  std::vector<std::string> result;
  for (const toml::node& item : *found.as_array()) {
    if (!item.is_string()) refuse(key, text_of(item), "must be a list of texts in quotes");
    result.push_back(item.as_string()->get());
  }
  return result;
}

std::vector<std::vector<double>> TomlTable::rows(const std::string& key) const {
  constexpr char kWhat[] = "must be a list of lists of numbers";
  const toml::node& found = node(key);
  if (!found.is_array()) refuse(key, text_of(found), kWhat);
  std::vector<std::vector<double>> result;
  for (const toml::node& row : *found.as_array()) {
    if (!row.is_array()) refuse(key, text_of(row), kWhat);
    std::vector<double>& numbers = result.emplace_back();
    for (const toml::node& item : *row.as_array()) {
      if (!item.is_number()) refuse(key, text_of(item), kWhat);
      numbers.push_back(*item.value<double>());
      if (!std::isfinite(numbers.back())) refuse(key, text_of(item), "must be finite");
    }
  }
  return result;
}

bool TomlTable::is_list(const std::string& key) const {
  const toml::node* const found = table_->get(key);
  return found != nullptr && found->is_array();
}

bool TomlTable::is_list_of_lists(const std::string& key) const {
  return is_list(key) && !table_->get(key)->as_array()->empty() &&
         table_->get(key)->as_array()->front().is_array();
}

TomlTable TomlTable::table(const std::string& key) const {
  const toml::node& found = node(key);
  if (!found.is_table()) refuse(key, text_of(found), "must be a table");
  return TomlTable(*found.as_table(), path_, prefix_ + key + ".");
}

std::vector<TomlTable> TomlTable::tables(const std::string& key) const {
  const toml::node& found = node(key);
  if (!found.is_array()) refuse(key, text_of(found), "must be a list of tables", "write [[" + key + "]]");
  std::vector<TomlTable> result;
  for (const toml::node& item : *found.as_array()) {
    if (!item.is_table()) refuse(key, text_of(item), "must be a list of tables", "write [[" + key + "]]");
    const std::string number = std::to_string(result.size() + 1);
    result.push_back(TomlTable(*item.as_table(), path_, prefix_ + key + "[" + number + "]."));
  }
  return result;
}

bool TomlTable::flag(const std::string& key) const {
  const toml::node& found = node(key);
  if (!found.is_boolean()) refuse(key, text_of(found), "must be true or false");
  return found.as_boolean()->get();
}

std::size_t TomlTable::choice(const std::string& key, const std::vector<std::string>& allowed) const {
  const std::string word = text(key);
  const auto found = std::find(allowed.begin(), allowed.end(), word);
  if (found == allowed.end())
    refuse(key, in_quotes(word), "is not one of the possible values", did_you_mean(word, allowed));
  return static_cast<std::size_t>(found - allowed.begin());
}

}  // namespace swarmcert::files
