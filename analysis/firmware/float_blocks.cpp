#include "analysis/firmware/float_blocks.h"

#include <fmt/core.h>

#include <cctype>
#include <charconv>
#include <cstring>

#include "nn/base/input_error.h"

namespace swarmcert::firmware {
namespace {

bool is_word(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }

/// Parses an unsigned literal at `at`. Returns false if there is none, or if it is not a number that fits a float.
bool parse_literal(const std::string& text, std::size_t& at, float& value) {
  const char* first = text.data() + at;
  const char* const last = text.data() + text.size();
  const bool is_hex = last - first > 2 && first[0] == '0' && (first[1] == 'x' || first[1] == 'X');
  const std::chars_format format = is_hex ? std::chars_format::hex : std::chars_format::general;
  if (is_hex) first += 2;
  double wide = 0;
  const auto [end, error] = std::from_chars(first, last, wide, format);
  if (error != std::errc()) return false;
  value = static_cast<float>(wide);
  const char* after = end;
  if (after != last && (*after == 'f' || *after == 'F')) {
    if (std::from_chars(first, last, value, format).ec != std::errc()) return false;
    ++after;
  }
  if (after != last && is_word(*after)) return false;
  at = static_cast<std::size_t>(after - text.data());
  return true;
}

/// Scans source text: remembers names before '=' and collects the numbers between the braces that follow.
class SourceScanner {
 public:
  explicit SourceScanner(const std::string& text) : text_(text) {}

  std::vector<FloatBlock> run() {
    while (at_ < text_.size()) step();
    return std::move(blocks_);
  }

 private:
  void step() {
    const char c = text_[at_];
    if (c == '\n') {
      ++line_;
      ++at_;
    } else if (text_.compare(at_, 2, "//") == 0 || (c == '#' && depth_ == 0)) {
      at_ = std::min(text_.find('\n', at_), text_.size());
    } else if (text_.compare(at_, 2, "/*") == 0) {
      const std::size_t end = std::min(text_.find("*/", at_ + 2), text_.size() - 2) + 2;
      for (; at_ < end; ++at_) line_ += text_[at_] == '\n';
    } else if (c == '"') {
      for (++at_; at_ < text_.size() && text_[at_] != '"' && text_[at_] != '\n'; ++at_)
        at_ += text_[at_] == '\\';
      ++at_;
    } else if (std::isdigit(static_cast<unsigned char>(c)) != 0 || c == '.') {
      number();
    } else if (is_word(c)) {
      const std::size_t first = at_;
      while (at_ < text_.size() && is_word(text_[at_])) ++at_;
      word_ = text_.substr(first, at_ - first);
    } else {
      punctuation(c);
      ++at_;
    }
  }

  void number() {
    const bool is_member = text_[at_] == '.' && at_ + 1 < text_.size() &&
                           !std::isdigit(static_cast<unsigned char>(text_[at_ + 1]));
    float value = 0;
    if (is_member) {
      ++at_;
    } else if (!parse_literal(text_, at_, value)) {
      while (at_ < text_.size() && (is_word(text_[at_]) || text_[at_] == '.')) ++at_;
      is_negative_ = false;
    } else if (depth_ > 0) {
      store(is_negative_ ? -value : value);
    }
    is_negative_ = false;
  }

  void punctuation(char c) {
    if (std::isspace(static_cast<unsigned char>(c)) == 0) is_negative_ = c == '-';
    if (c == '=' && depth_ == 0) variable_ = name_before_brackets();
    if (c == '=' && depth_ > 0) starts_new_ = true, member_ = word_;
    if (c == ';' && depth_ == 0) variable_.clear();
    if (c == '{' && !variable_.empty()) {
      if (depth_++ == 0) starts_new_ = true, member_.clear();
    }
    if (c == '}' && depth_ > 0) --depth_;
  }

  /// For "float name[4][3] =": the word before the first bracket.
  std::string name_before_brackets() const {
    std::size_t end = at_;
    while (end > 0 &&
           (std::isspace(static_cast<unsigned char>(text_[end - 1])) != 0 || text_[end - 1] == ']')) {
      if (text_[end - 1] == ']')
        end = text_.rfind('[', end - 1) == std::string::npos ? 0 : text_.rfind('[', end - 1);
      else
        --end;
    }
    std::size_t first = end;
    while (first > 0 && is_word(text_[first - 1])) --first;
    return text_.substr(first, end - first);
  }

  void store(float value) {
    if (starts_new_) {
      blocks_.emplace_back();
      blocks_.back().name = member_.empty() ? variable_ : variable_ + "." + member_;
      starts_new_ = false;
    }
    blocks_.back().bits.push_back(float_bits(value));
    blocks_.back().lines.push_back(line_);
  }

  const std::string& text_;
  std::vector<FloatBlock> blocks_;
  std::string word_, variable_, member_;
  std::size_t at_ = 0;
  std::uint32_t line_ = 1;
  int depth_ = 0;
  bool starts_new_ = false, is_negative_ = false;
};

}  // namespace

std::string FloatBlock::place(std::size_t index) const {
  if (index < lines.size()) return fmt::format("line {}", lines[index]);
  return fmt::format("address {:#x}", address + 4 * index);
}

std::vector<FloatBlock> blocks_in_source(const std::string& text, const std::string& path) {
  std::vector<FloatBlock> blocks = SourceScanner(text).run();
  if (blocks.empty()) {
    throw files::InputError({path, "", "", "", "no initialiser with numbers",
                             "name C or C++ source with weight arrays, or an ELF"});
  }
  return blocks;
}

}  // namespace swarmcert::firmware
