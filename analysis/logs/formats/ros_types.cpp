#include "analysis/logs/formats/ros_types.h"

#include <algorithm>
#include <charconv>
#include <map>
#include <set>

#include "analysis/logs/csv.h"
#include "analysis/logs/dictionary.h"
#include "nn/base/text.h"

namespace swarmcert::logs {
namespace {

constexpr std::size_t kMostTypes = 512;
constexpr std::size_t kMostFields = 2048;
constexpr std::size_t kLargestFixedArray = std::size_t{1} << 20;
constexpr int kDeepestMessage = 12;

std::optional<Scalar> ros_number(std::string_view name) {
  if (name == "bool" || name == "byte" || name == "char") return Scalar::kUint8;
  if (name == "float32") return Scalar::kFloat;
  if (name == "float64") return Scalar::kDouble;
  return name == "float" || name == "double" ? std::nullopt : scalar_called(name);
}

/// Removes and returns the next word; `line` keeps the rest.
std::string_view next_word(std::string_view& line) {
  const std::string_view kBlank = " \t\r";
  line.remove_prefix(std::min(line.find_first_not_of(kBlank), line.size()));
  const std::size_t end = std::min(line.find_first_of(kBlank), line.size());
  const std::string_view word = line.substr(0, end);
  line.remove_prefix(end);
  line.remove_prefix(std::min(line.find_first_not_of(kBlank), line.size()));
  return word;
}

/// A field as written, before its type name is resolved.
struct WrittenField {
  RosField field;
  std::string type;  ///< of kMessage
};
using WrittenType = std::vector<WrittenField>;

/// Parses "[3]", "[]" or "[<=3]" after a type. Returns false if it is none of them.
bool parse_array(std::string_view brackets, RosField& field) {
  if (brackets.empty()) return true;
  if (brackets.size() < 2 || brackets.front() != '[' || brackets.back() != ']') return false;
  const std::string_view inside = brackets.substr(1, brackets.size() - 2);
  field.array = RosArray::kSequence;
  if (inside.empty() || inside.substr(0, 2) == "<=") return true;
  field.array = RosArray::kFixed;
  const auto [end, error] = std::from_chars(inside.data(), inside.data() + inside.size(), field.count);
  return error == std::errc() && end == inside.data() + inside.size() && field.count >= 1 &&
         field.count <= kLargestFixedArray;
}

bool is_type_name(std::string_view name) {
  const std::vector<std::string> parts = files::split_at(name, "/");
  return !parts.empty() && name.back() != '/' &&
         std::all_of(parts.begin(), parts.end(), [](const std::string& part) { return is_identifier(part); });
}

/// @param package of the definition, for type names without a package
bool parse_type(std::string_view text, const std::string& package, WrittenField& written) {
  const std::size_t bracket = std::min(text.find('['), text.size());
  if (!parse_array(text.substr(bracket), written.field)) return false;
  std::string_view name = text.substr(0, bracket);
  const std::size_t bound = name.find("<=");  // string<=10
  if (bound != std::string_view::npos) name = name.substr(0, bound);
  if (name == "string") {
    written.field.kind = RosKind::kText;
    return true;
  }
  if (bound != std::string_view::npos || name == "wstring") return false;
  if (const std::optional<Scalar> number = ros_number(name)) {
    written.field.number = *number;
    return true;
  }
  if (!is_type_name(name)) return false;
  written.type =
      name.find('/') == std::string_view::npos ? package + "/" + std::string(name) : short_type_name(name);
  const bool is_stamp =
      written.type == "builtin_interfaces/Time" || written.type == "builtin_interfaces/Duration";
  written.field.kind = is_stamp ? RosKind::kStamp : RosKind::kMessage;
  return true;
}

std::string_view without_comment(std::string_view line) {
  // A "#" within a default text truncates only the default, which is not needed.
  return line.substr(0, line.find('#'));
}

/// Parses one line of a definition; constants are ignored. Returns false if the line is invalid.
bool parse_line(std::string_view line, const std::string& package, WrittenType& type) {
  std::string_view rest = without_comment(line);
  const std::string_view type_word = next_word(rest);
  if (type_word.empty()) return true;
  const std::string_view name = next_word(rest);
  const bool is_constant = name.find('=') != std::string_view::npos || (!rest.empty() && rest[0] == '=');
  if (is_constant) return is_identifier(name.substr(0, name.find('=')));
  WrittenField written;
  written.field.name = name;
  if (!is_identifier(name) || !parse_type(type_word, package, written)) return false;
  type.push_back(std::move(written));
  return true;
}

/// Collects the types of a definition and orders them.
class SchemaBuilder {
 public:
  RosDefinition build(const std::string& name, std::string_view text) {
    RosDefinition result;
    const std::string root = short_type_name(name);
    if (text.size() > kLongestDefinition_bytes) {
      result.fault = "its definition is over 1 MiB long";
    } else if (parse(root, text) && add(root, 0)) {
      result.schema = RosSchema{std::move(types_)};
    } else {
      result.fault = fault_;
    }
    return result;
  }

 private:
  bool fail(const std::string& fault) {
    if (fault_.empty()) fault_ = fault;
    return false;
  }

  /// Parses all definitions of `text` into written_; the first one is `name`.
  bool parse(std::string name, std::string_view text) {
    WrittenType type;
    for (std::size_t at = 0; at < text.size();) {
      const std::string_view line = take_text_line(text, at);
      if (line.substr(0, 3) == "===") {
        written_.emplace(name, std::move(type));
        type.clear();
        std::string_view head = take_text_line(text, at);
        if (next_word(head) != "MSG:") return fail("its definition has no \"MSG:\" after a line of \"=\"");
        name = short_type_name(next_word(head));
        if (written_.size() > kMostTypes) return fail("its definition has over 512 types");
        continue;
      }
      if (!parse_line(line, name.substr(0, name.find('/')), type))
        return fail("its definition has a line that cannot be used: \"" + std::string(line.substr(0, 60)) +
                    "\"");
      if (type.size() > kMostFields) return fail("its definition has over 2048 fields in one type");
    }
    written_.emplace(std::move(name), std::move(type));
    return true;
  }

  const WrittenType* find(const std::string& name) {
    const auto found = written_.find(name);
    if (found != written_.end()) return &found->second;
    const std::vector<RosMessageText> builtin = builtin_ros_definitions(name);
    if (builtin.empty() || !parse(name, builtin[0].text)) return nullptr;
    return &written_.at(name);
  }

  /// Adds `name` and the types it uses to types_; returns false and sets the reason if that is impossible.
  bool add(const std::string& name, int depth) {
    if (depth > kDeepestMessage) return fail("its definition is nested too deeply, or contains itself");
    const WrittenType* const written = find(name);
    if (written == nullptr) return fail("the file does not define " + name);
    const std::size_t index = types_.size();
    index_of_.emplace(name, index);
    types_.push_back({name, {}});
    std::vector<RosField> fields;
    std::set<std::string> names;
    for (const WrittenField& each : *written) {
      RosField field = each.field;
      if (!names.insert(field.name).second) return fail(name + " has two fields \"" + field.name + "\"");
      if (field.kind == RosKind::kMessage) {
        const auto known = index_of_.find(each.type);
        if (known == index_of_.end() && !add(each.type, depth + 1)) return false;
        field.message = index_of_.at(each.type);
        if (heights_.count(field.message) == 0) return fail(name + " contains itself");
      }
      fields.push_back(std::move(field));
    }
    if (fields.empty())
      fields.push_back(
          {"structure_needs_at_least_one_member", RosKind::kNumber, Scalar::kUint8, 0, RosArray::kNone, 1});
    int height = 0;
    for (const RosField& field : fields)
      if (field.kind == RosKind::kMessage) height = std::max(height, 1 + heights_.at(field.message));
    if (height > kDeepestMessage) return fail("its definition is nested too deeply");
    heights_[index] = height;
    types_[index].fields = std::move(fields);
    return true;
  }

  std::map<std::string, WrittenType> written_;
  std::vector<RosType> types_;
  std::map<std::string, std::size_t> index_of_;
  std::map<std::size_t, int> heights_;  ///< of the complete types
  std::string fault_;
};

}  // namespace

std::vector<RosMessageText> builtin_ros_definitions(const std::string& name) {
  constexpr std::string_view kStart = "\nMSG: ";
  const std::string_view all = dictionary_text("ros_messages.msg");
  std::vector<RosMessageText> found;
  for (std::size_t at = all.find(kStart); at < all.size();) {
    const std::size_t begin = at + kStart.size(), end = all.find('\n', begin);
    at = std::min(all.find(kStart, begin), all.size());
    const std::string_view text = all.substr(end, at - end);
    if (all.substr(begin, end - begin) == name)
      found.push_back({text, text.find("\n# ...") != std::string_view::npos});
  }
  return found;
}

std::string short_type_name(std::string_view name) {
  const std::size_t first = name.find('/');
  const std::size_t last = name.rfind('/');
  if (first == last) return std::string(name);
  return std::string(name.substr(0, first)) + std::string(name.substr(last));
}

std::string long_type_name(std::string_view name) {
  const std::string brief = short_type_name(name);
  const std::size_t slash = brief.find('/');
  return slash == std::string::npos ? brief : brief.substr(0, slash) + "/msg" + brief.substr(slash);
}

RosDefinition parse_ros_definition(const std::string& name, std::string_view text) {
  return SchemaBuilder().build(name, text);
}

}  // namespace swarmcert::logs
