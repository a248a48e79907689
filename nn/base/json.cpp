#include "nn/base/json.h"

#include <charconv>
#include <cmath>
#include <stdexcept>
#include <unordered_set>

#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "nn/base/suggest.h"

namespace swarmcert::files {
namespace {

constexpr int kDeepest = 64;
constexpr std::size_t kMostKeys = 10'000;  // ordered_json finds keys by linear search

std::string line_and_column(const std::string& text, std::size_t offset) {
  std::size_t line = 1;
  std::size_t column = 1;
  for (std::size_t i = 0; i < offset && i < text.size(); ++i) {
    ++column;
    if (text[i] == '\n') ++line, column = 1;
  }
  return "line " + std::to_string(line) + ", column " + std::to_string(column);
}

/// Iterates over `text` and stores the parser's progress in `position`, which its callback does not receive.
class TrackingIterator {
 public:
  using iterator_category = std::input_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;

  TrackingIterator(const char* at, const char** position) : at_(at), position_(position) {}
  reference operator*() const { return *at_; }
  TrackingIterator& operator++() {
    *position_ = ++at_;
    return *this;
  }
  TrackingIterator operator++(int) {
    const TrackingIterator before = *this;
    ++*this;
    return before;
  }
  bool operator==(const TrackingIterator& other) const { return at_ == other.at_; }
  bool operator!=(const TrackingIterator& other) const { return at_ != other.at_; }

 private:
  const char* at_;
  const char** position_;
};

/// "is not JSON (...)" from "[json.exception.parse_error.101] parse error at line 1, column 2: ...".
std::string reason(const std::string& message) {
  const std::size_t colon = message.find(": ");
  return "is not JSON (" + (colon == std::string::npos ? message : message.substr(colon + 2)) + ")";
}

/// Reads a hex float from left to right. Throws if the text is not a hex float.
class HexFloatReader {
 public:
  explicit HexFloatReader(const std::string& text) : text_(text) {}

  double read() {
    const bool is_negative = accept('-');
    if (!accept('0') || !accept('x')) refuse();
    read_mantissa();
    if (!accept('p')) refuse();
    read_exponent();
    if (at_ != text_.size()) refuse();
    return is_negative ? -value() : value();
  }

 private:
  [[noreturn]] void refuse() const {
    throw std::invalid_argument("parse_hex_float: " + in_quotes(text_) +
                                " is not a finite hex float of a double");
  }

  bool accept(char lower) {
    const bool is_here =
        at_ < text_.size() && (text_[at_] == lower || (lower >= 'a' && text_[at_] == lower - 'a' + 'A'));
    if (is_here) ++at_;
    return is_here;
  }

  /// Returns the value of the next character as a hex digit, or -1 if it is not one.
  int digit() const {
    const char c = at_ < text_.size() ? text_[at_] : '\0';
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    return c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
  }

  void read_mantissa() {
    bool has_digits = false;
    bool is_fraction = false;
    for (;;) {
      if (!is_fraction && accept('.')) {
        is_fraction = true;
        continue;
      }
      const int next = digit();
      if (next < 0) break;
      has_digits = true;
      ++at_;
      if (mantissa_ >> 60 == 0) {
        mantissa_ = mantissa_ << 4 | static_cast<std::uint64_t>(next);
        exponent_ -= is_fraction ? 4 : 0;
      } else {  // all 64 bits are used: further digits must be zero
        if (next != 0) refuse();
        exponent_ += is_fraction ? 0 : 4;
      }
    }
    if (!has_digits) refuse();
  }

  void read_exponent() {
    const bool is_small = accept('-');
    if (!is_small) accept('+');
    long power = 0;
    const std::size_t first = at_;
    for (; at_ < text_.size() && text_[at_] >= '0' && text_[at_] <= '9'; ++at_) {
      if (power > 100'000) refuse();
      power = 10 * power + (text_[at_] - '0');
    }
    if (at_ == first) refuse();
    exponent_ += is_small ? -power : power;
  }

  double value() const {
    if (mantissa_ == 0) return 0;
    std::uint64_t mantissa = mantissa_;
    long exponent = exponent_;
    while (mantissa % 2 == 0) mantissa /= 2, ++exponent;
    const bool is_exact =
        mantissa >> 53 == 0 && exponent >= -1074;  // at most 53 bits, and none below the smallest subnormal
    const double value =
        is_exact ? std::ldexp(static_cast<double>(mantissa), static_cast<int>(exponent)) : INFINITY;
    if (std::isinf(value)) refuse();
    return value;
  }

  const std::string& text_;
  std::size_t at_ = 0;
  std::uint64_t mantissa_ = 0;
  long exponent_ = 0;  ///< exponent of the mantissa's last digit
};

}  // namespace

std::string hex_float(double value) {
  if (std::isnan(value)) return "nan";
  if (std::isinf(value)) return value > 0 ? "inf" : "-inf";
  char digits[40];
  const auto result = std::to_chars(digits, digits + sizeof digits, std::abs(value), std::chars_format::hex);
  return (std::signbit(value) ? "-0x" : "0x") + std::string(digits, result.ptr);
}

double parse_hex_float(const std::string& text) { return HexFloatReader(text).read(); }

void require_keys(const Json& object, const std::set<std::string>& keys, const std::string& where) {
  if (!object.is_object()) throw std::invalid_argument(where + " is not an object");
  for (const auto& [key, value] : object.items()) {
    if (keys.count(key) == 0) throw std::invalid_argument(where + " has unknown field " + key);
  }
  for (const std::string& key : keys) {
    if (!object.contains(key)) throw std::invalid_argument(where + " lacks field " + key);
  }
}

std::vector<double> parse_hex_floats(const Json& array) {
  if (!array.is_array()) throw std::invalid_argument("parse_hex_floats: not an array");
  std::vector<double> values;
  for (const Json& text : array) values.push_back(parse_hex_float(text.get<std::string>()));
  return values;
}

Json parse_json(const std::string& text, const std::string& path) {
  if (text.compare(0, 3, "\xef\xbb\xbf") == 0)
    throw InputError({path, "line 1", "", "", "begins with a byte order mark, which is not valid JSON",
                      "save it without"});
  const char* position = text.data();
  const auto here = [&] { return line_and_column(text, static_cast<std::size_t>(position - text.data())); };
  std::vector<std::unordered_set<std::string>> keys;  // of the objects that are currently open
  const auto check = [&](int depth, Json::parse_event_t event, Json& parsed) {
    if (event == Json::parse_event_t::object_start || event == Json::parse_event_t::array_start) {
      if (depth >= kDeepest)
        throw InputError({path, here(), "", "", "is nested more than 64 levels deep", ""});
    }
    if (event == Json::parse_event_t::object_start) keys.emplace_back();
    if (event == Json::parse_event_t::object_end) keys.pop_back();
    if (event == Json::parse_event_t::key) {
      const std::string key = parsed.get<std::string>();
      if (!keys.back().insert(key).second)
        throw InputError({path, here(), in_quotes(key), "", "appears twice", ""});
      if (keys.back().size() > kMostKeys)
        throw InputError({path, here(), "", "", "an object has too many keys", ""});
    }
    return true;
  };
  try {
    const char* const end = text.data() + text.size();
    return Json::parse(TrackingIterator(text.data(), &position), TrackingIterator(end, &position), check);
  } catch (const Json::exception& error) {
    throw InputError({path, here(), "", "", reason(error.what()), ""});
  }
}

Json parse_json(const std::string& text, const std::string& path, const std::string& schema) {
  Json document = parse_json(text, path);
  if (!document.is_object()) throw InputError({path, "line 1", "", "", "is not a JSON object", ""});
  const std::string found = document.contains("schema") && document["schema"].is_string()
                                ? document["schema"].get<std::string>()
                                : "";
  if (found != schema) {
    throw InputError({path, "", "schema", found.empty() ? "" : in_quotes(found),
                      "must be " + in_quotes(schema), "is this the right file?"});
  }
  return document;
}

Json read_json(const std::string& path, const std::string& schema) {
  return parse_json(read_file(path), path, schema);
}

std::string to_text(const Json& document) {
  // A path may contain bytes that are not UTF-8; these are written as replacement characters instead of failing.
  return document.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace swarmcert::files
