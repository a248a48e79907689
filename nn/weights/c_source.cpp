#include "nn/weights/c_source.h"

#include <charconv>
#include <cmath>
#include <map>
#include <string_view>

#include "nn/base/input_error.h"
#include "nn/base/suggest.h"
#include "nn/base/text.h"
#include "nn/weights/tensors.h"

namespace swarmcert::files {
namespace {

constexpr char kPrefix[] = "weights_";

bool is_word(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
}
bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Tokenizes C text into words, numbers and single characters, skipping comments and preprocessor lines.
class Scanner {
 public:
  Scanner(std::string_view text, std::string path) : text_(text), path_(std::move(path)) { skip(); }

  bool at_end() const { return at_ == text_.size(); }

  [[noreturn]] void refuse(const std::string& field, const std::string& what,
                           const std::string& hint = "") const {
    std::size_t line = 1;
    for (std::size_t i = 0; i < at_; ++i) line += text_[i] == '\n' ? 1 : 0;
    throw InputError({path_, "line " + std::to_string(line), field, "", what, hint});
  }

  bool accept(char c) {
    if (at_end() || text_[at_] != c) return false;
    ++at_;
    skip();
    return true;
  }
  void expect(char c, const std::string& where) {
    if (!accept(c)) refuse(where, std::string("expected '") + c + "'" + found());
  }
  /// Reads a name or keyword; returns an empty view if there is none here.
  std::string word() {
    const std::size_t first = at_;
    if (!at_end() && !is_digit(text_[at_])) {
      while (!at_end() && is_word(text_[at_])) ++at_;
    }
    const std::string result(text_.substr(first, at_ - first));
    skip();
    return result;
  }
  bool accept_word(const std::string& expected) {
    const std::size_t before = at_;
    if (word() == expected) return true;
    at_ = before;
    return false;
  }
  std::uint64_t size(const std::string& where) {
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(text_.data() + at_, text_.data() + text_.size(), value);
    if (error != std::errc()) refuse(where, "expected the size of an array" + found());
    at_ = static_cast<std::size_t>(end - text_.data());
    skip();
    return value;
  }
  /// Reads a decimal number and rounds it as a compiler does for a member of this precision.
  double number(Precision precision, const std::string& where) {
    const bool is_negative = at_ < text_.size() && text_[at_] == '-';
    const char* const first = text_.data() + at_ + (is_negative ? 1 : 0);
    const char* const last = text_.data() + text_.size();
    double value = 0;
    auto [end, error] = std::from_chars(first, last, value);
    // from_chars would also accept "inf" and "nan", which are not C literals.
    if (error == std::errc::invalid_argument || first == last || !(is_digit(*first) || *first == '.'))
      refuse(where, "expected a number" + found());
    float narrow = 0;
    bool is_out_of_range = error != std::errc();
    if (end != last && (*end == 'f' || *end == 'F')) {  // rounded once, directly from the decimal
      is_out_of_range = std::from_chars(first, last, narrow).ec != std::errc();
      value = static_cast<double>(narrow);
      ++end;
    } else if (precision == Precision::kFloat32 && !is_out_of_range) {
      is_out_of_range = !(std::abs(value) < 0x1.ffffffp127);
      if (!is_out_of_range) value = static_cast<double>(static_cast<float>(value));
    }
    if (end != last && is_word(*end)) refuse(where, "expected a decimal number" + found());
    if (is_out_of_range) refuse(where, "the number is beyond the range of its type");
    at_ = static_cast<std::size_t>(end - text_.data());
    skip();
    return is_negative ? -value : value;
  }

 private:
  std::string found() const {
    return at_end() ? ", found the end of the file" : ", found " + in_quotes(text_.substr(at_, 20));
  }
  void skip() {
    for (;;) {
      while (at_ < text_.size() &&
             (text_[at_] == ' ' || text_[at_] == '\t' || text_[at_] == '\r' || text_[at_] == '\n'))
        ++at_;
      const std::string_view rest = text_.substr(at_);
      if (rest.substr(0, 2) == "//" || rest.substr(0, 1) == "#") {
        at_ = std::min(text_.find('\n', at_), text_.size());
      } else if (rest.substr(0, 2) == "/*") {
        const std::size_t end = text_.find("*/", at_ + 2);
        at_ = end == std::string_view::npos ? text_.size() : end + 2;
      } else {
        return;
      }
    }
  }

  std::string_view text_;
  std::string path_;
  std::size_t at_ = 0;
};

struct Member {
  std::string name;
  Precision precision = Precision::kFloat32;
  std::vector<std::uint64_t> shape;
  std::vector<double> values;  ///< in the order of the source text
};

class SourceReader {
 public:
  SourceReader(const std::string& bytes, const std::string& path, const LayerChoice& choice)
      : scanner_(bytes, path), path_(path), choice_(choice) {}

  Weights run(const std::string& key) {
    read();
    return weights(chosen(key));
  }

  std::map<std::string, Weights> run_all() {
    read();
    std::map<std::string, Weights> all;
    for (const auto& [name, members] : objects_) all.emplace(name, weights(members));
    return all;
  }

 private:
  void read() {
    while (!scanner_.at_end()) {
      while (scanner_.accept_word("static") || scanner_.accept_word("const")) continue;
      if (!scanner_.accept_word("struct"))
        scanner_.refuse("", "expected a struct or an object of one",
                        "only the generated layout of weights can be read");
      const std::string tag = scanner_.word();
      if (scanner_.accept('{')) {
        read_type(tag);
      } else {
        read_object(tag);
      }
    }
  }

  void read_type(const std::string& tag) {
    std::vector<Member> members;
    while (!scanner_.accept('}')) {
      Member member;
      if (scanner_.accept_word("double")) {
        member.precision = Precision::kFloat64;
      } else if (!scanner_.accept_word("float")) {
        scanner_.refuse(tag, "a member is neither float nor double");
      }
      member.name = scanner_.word();
      while (scanner_.accept('[')) {
        member.shape.push_back(scanner_.size(member.name));
        scanner_.expect(']', member.name);
      }
      scanner_.expect(';', member.name);
      if (member.shape.empty() || member.shape.size() > 2)
        scanner_.refuse(member.name, "is neither a matrix nor a vector");
      members.push_back(std::move(member));
    }
    scanner_.expect(';', tag);
    if (!types_.emplace(tag, std::move(members)).second) scanner_.refuse(tag, "is defined twice");
  }

  void read_object(const std::string& tag) {
    const std::string name = scanner_.word();
    const auto type = types_.find(tag);
    if (type == types_.end()) scanner_.refuse(name, "is of the unknown type " + in_quotes(tag));
    std::vector<Member> members = type->second;
    scanner_.expect('=', name);
    scanner_.expect('{', name);
    while (!scanner_.accept('}')) {
      scanner_.expect('.', name);
      const std::string field = scanner_.word();
      Member* member = nullptr;
      for (Member& candidate : members)
        if (candidate.name == field) member = &candidate;
      if (member == nullptr) scanner_.refuse(name + "." + field, "is not a member of its type");
      if (!member->values.empty()) scanner_.refuse(name + "." + field, "is initialised twice");
      scanner_.expect('=', field);
      const std::optional<std::uint64_t> count = element_count(member->shape);
      if (!count || *count == 0)
        scanner_.refuse(field, "has the impossible shape " + shape_text(member->shape));
      read_array(*member, 0);
      if (!scanner_.accept(',')) {
        scanner_.expect('}', name);
        break;
      }
    }
    scanner_.expect(';', name);
    for (const Member& member : members)
      if (member.values.empty()) scanner_.refuse(name + "." + member.name, "is not initialised");
    const std::string key = name.rfind(kPrefix, 0) == 0 ? name.substr(sizeof kPrefix - 1) : name;
    if (!objects_.emplace(key, std::move(members)).second) scanner_.refuse(name, "is defined twice");
  }

  void read_array(Member& member, std::size_t depth) {
    scanner_.expect('{', member.name);
    for (std::uint64_t i = 0; i < member.shape[depth]; ++i) {
      if (i > 0) scanner_.expect(',', member.name);
      if (depth + 1 < member.shape.size()) {
        read_array(member, depth + 1);
      } else {
        member.values.push_back(scanner_.number(member.precision, member.name));
      }
    }
    scanner_.accept(',');
    scanner_.expect('}', member.name);
  }

  const std::vector<Member>& chosen(const std::string& key) const {
    std::vector<std::string> names;
    std::string list;
    for (const auto& [name, members] : objects_) {
      names.push_back(name);
      list += (list.empty() ? "" : ", ") + name;
    }
    if (names.empty())
      throw InputError({path_, "", "", "", "holds no network", "name the generated weights"});
    if (key.empty() && names.size() > 1)
      throw InputError(
          {path_, "", "", "", "holds several networks: " + list, "name one: " + path_ + "#" + names[0]});
    const auto found = objects_.find(key.empty() ? names[0] : key);
    if (found == objects_.end())
      throw InputError({path_, "", "", in_quotes(key), "is not in this file, which holds " + list,
                        did_you_mean(key, names)});
    return found->second;
  }

  Weights weights(const std::vector<Member>& members) const {
    std::vector<DeclaredTensor> declared;
    for (const Member& member : members) {
      std::string name = member.name;
      for (const std::string_view part : {"weight", "bias"}) {
        if (name.size() > part.size() + 1 && ends_with(name, "_" + std::string(part)))
          name = name.substr(0, name.size() - part.size() - 1) + "." + std::string(part);
      }
      DeclaredTensor tensor{name, member.precision, "", member.shape};
      if (tensor.shape.size() == 2) std::swap(tensor.shape[0], tensor.shape[1]);
      declared.push_back(std::move(tensor));
    }
    const TensorReader read = [&members](std::size_t i) {
      const Member& member = members[i];
      if (member.shape.size() == 1) return member.values;
      std::vector<double> transposed;
      transposed.reserve(member.values.size());
      for (std::uint64_t out = 0; out < member.shape[1]; ++out) {
        for (std::uint64_t in = 0; in < member.shape[0]; ++in)
          transposed.push_back(member.values[in * member.shape[1] + out]);
      }
      return transposed;
    };
    return assemble(declared, read, path_, Listing::kRegistration, choice_);
  }

  Scanner scanner_;
  const std::string& path_;
  const LayerChoice& choice_;
  std::map<std::string, std::vector<Member>> types_;
  std::map<std::string, std::vector<Member>> objects_;
};

}  // namespace

bool looks_like_c_source(const std::string& bytes) {
  const std::string_view beginning = std::string_view(bytes).substr(0, 4096);
  if (beginning.find('\0') != std::string_view::npos) return false;
  Scanner scanner(beginning, "");
  const std::string first = scanner.word();
  return first == "struct" || first == "static" || first == "const";
}

Weights parse_c_source(const std::string& bytes, const std::string& path, const std::string& key,
                       const LayerChoice& choice) {
  return SourceReader(bytes, path, choice).run(key);
}

std::map<std::string, Weights> parse_pure_c_source(const std::string& bytes, const std::string& path) {
  std::size_t line = 1;
  for (std::size_t at = 0; at < bytes.size(); ++line) {
    const std::size_t end = std::min(bytes.find('\n', at), bytes.size());
    std::string_view text = std::string_view(bytes).substr(at, end - at);
    const auto refuse = [&](const std::string& what) {
      throw InputError({path, "line " + std::to_string(line), "", "", what, ""});
    };
    while (!text.empty() && (text.back() == '\r' || text.back() == ' ' || text.back() == '\t'))
      text.remove_suffix(1);
    while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
    // A comment before a directive, as in "/* */ #if", does not disable it.
    const bool is_plain = text.find('#') == std::string_view::npos || text.substr(0, 8) == "#include" ||
                          text.substr(0, 7) == "#pragma";
    if (!is_plain) refuse("a preprocessor line, which may change the text that a compiler sees");
    if (!text.empty() && text.back() == '\\') refuse("a continued line");
    at = end + 1;
  }
  return SourceReader(bytes, path, {}).run_all();
}

}  // namespace swarmcert::files
