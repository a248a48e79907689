#include "nn/files/toml.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string_view>

#include "nn/files/input_error.h"
#include "nn/files/suggest.h"

namespace swarmcert::files {
namespace {

constexpr std::size_t kLargestToml_bytes = std::size_t{64} << 10;
/// Every dot of a key "a.b.c" opens a table, and toml++ destroys nested tables recursively: 30 000 overflow the stack.
/// Dots in numbers and file names count as well, of which our files have a few hundred.
constexpr std::ptrdiff_t kMostDots = 4000;

/// Refuses what toml++ 3.3 reads in undefined ways: letters beyond ASCII outside of quotes and comments run into its
/// __builtin_unreachable(). TOML allows them nowhere else.
class Guard {
 public:
  Guard(const std::string& text, const std::string& path) : text_(text), path_(path) {}

  void run() {
    if (text_.compare(0, 3, "\xef\xbb\xbf") == 0) at_ = 3;  // a byte order mark
    for (; at_ < text_.size(); ++at_) {
      const char c = text_[at_];
      if (c == '#') {
        skip_comment();
      } else if (c == '"' || c == '\'') {
        skip_string(c);
      } else if (!is_of_bare_key(c) &&
                 std::string_view(" \t\r\n=[]{},.+:").find(c) == std::string_view::npos) {
        refuse("this character may stand in quotes only");
      }
    }
  }

 private:
  static bool is_of_bare_key(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  }

  void skip_comment() {
    while (at_ + 1 < text_.size() && text_[at_ + 1] != '\n') ++at_;
  }

  void skip_string(char quote) {
    if (text_.compare(at_, 3, std::string(3, quote)) == 0) refuse("texts of several lines are not read");
    for (++at_; at_ < text_.size() && text_[at_] != quote; ++at_) {
      if (text_[at_] == '\n') refuse("the text has no closing quote");
      if (quote == '"' && text_[at_] == '\\') ++at_;
    }
  }

  [[noreturn]] void refuse(const std::string& what) const {
    const std::string before = text_.substr(0, std::min(at_, text_.size()));
    const std::size_t newline = before.rfind('\n');  // npos + 1 is 0
    throw InputError({path_,
                      "line " + std::to_string(std::count(before.begin(), before.end(), '\n') + 1) +
                          ", column " + std::to_string(before.size() - (newline + 1) + 1),
                      "", "", "is not TOML (" + what + ")", ""});
  }

  const std::string& text_;
  const std::string& path_;
  std::size_t at_ = 0;
};

std::string line(const toml::source_region& source) {
  return source.begin.line == 0 ? "" : "line " + std::to_string(source.begin.line);
}

/// The value as the user could have written it.
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
  Guard(text, path).run();
  try {
    return toml::parse(std::string_view(text), path);
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
    throw InputError(
        {path_, line(key.source()), prefix_ + name, "", "is not a known key", did_you_mean(name, known)});
  }
}

std::vector<std::string> TomlTable::keys() const {
  std::vector<std::string> result;
  for (const auto& [key, node] : *table_) result.emplace_back(key.str());
  return result;
}

void TomlTable::refuse(const std::string& key, const std::string& value, const std::string& what,
                       const std::string& mend) const {
  const toml::node* const found = key.empty() ? table_ : table_->get(key);
  const std::string where = line((found == nullptr ? table_ : found)->source());
  std::string field = prefix_ + key;
  if (key.empty() && !field.empty()) field.pop_back();
  throw InputError({path_, where, field, value, what, mend});
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

TomlTable TomlTable::table(const std::string& key) const {
  const toml::node& found = node(key);
  if (!found.is_table()) refuse(key, text_of(found), "must be a table");
  return TomlTable(*found.as_table(), path_, prefix_ + key + ".");
}

std::size_t TomlTable::choice(const std::string& key, const std::vector<std::string>& allowed) const {
  const std::string word = text(key);
  const auto found = std::find(allowed.begin(), allowed.end(), word);
  if (found == allowed.end())
    refuse(key, in_quotes(word), "is not one of the possible values", did_you_mean(word, allowed));
  return static_cast<std::size_t>(found - allowed.begin());
}

}  // namespace swarmcert::files
