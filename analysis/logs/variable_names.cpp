#include "analysis/logs/variable_names.h"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>

#include "analysis/logs/csv.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"

namespace swarmcert::logs {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLargestYaml_bytes = std::size_t{1} << 20;

std::string_view trimmed(std::string_view text) {
  const auto is_blank = [](char c) { return c == ' ' || c == '\t'; };
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

std::string unquoted(std::string_view text) {
  text = trimmed(text);
  const bool quoted = text.size() >= 2 && (text.front() == '"' || text.front() == '\'');
  if (quoted && text.back() == text.front()) text = text.substr(1, text.size() - 2);
  return std::string(text);
}

std::string_view before_comment(std::string_view line) {
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '#' && (i == 0 || line[i - 1] == ' ' || line[i - 1] == '\t')) return line.substr(0, i);
  }
  return line;
}

/// Reads the subset of YAML used by crazyflies.yaml: nested mappings, lists in brackets and lists of dashes.
class YamlReader {
 public:
  explicit YamlReader(CustomTopics& found) : found_(found) {}

  void line(std::string_view text) {
    text = before_comment(text);
    const std::size_t indent = std::min(text.find_first_not_of(' '), text.size());
    text = trimmed(text);
    if (text.empty()) return;
    if (in_brackets_) {
      add_items(text);
      return;
    }
    if (text.front() == '-' && (text.size() == 1 || text[1] == ' ')) {
      if (list_ != nullptr) list_->push_back(unquoted(text.substr(1)));
      return;
    }
    const std::size_t colon = text.find(':');
    if (colon == std::string_view::npos) return;
    while (!path_.empty() && path_.back().indent >= indent) path_.pop_back();
    path_.push_back({indent, unquoted(text.substr(0, colon))});
    list_ = nullptr;
    value(trimmed(text.substr(colon + 1)));
  }

 private:
  struct Key {
    std::size_t indent;
    std::string name;
  };

  /// Returns the element `places` after the first key called `section`; empty if the path has none.
  std::string behind(const std::string& section, std::size_t places) const {
    for (std::size_t i = 0; i + places < path_.size(); ++i)
      if (path_[i].name == section) return path_[i + places].name;
    return "";
  }

  void value(std::string_view text) {
    const std::size_t depth = path_.size();
    const std::string robot = behind("robots", 1), type = behind("robot_types", 1);
    if (path_.back().name == "type" && !robot.empty() && path_[depth - 2].name == robot)
      found_.type_of_robot[robot] = unquoted(text);
    if (path_.back().name != "vars" || depth < 3 || path_[depth - 3].name != "custom_topics") return;
    const std::string owner = !robot.empty()  ? "robots/" + robot
                              : !type.empty() ? "robot_types/" + type
                                              : "all";
    list_ = &found_.named[{owner, path_[depth - 2].name}];
    list_->clear();
    if (text.empty() || text.front() != '[') return;
    in_brackets_ = true;
    add_items(text.substr(1));
  }

  void add_items(std::string_view text) {
    const std::size_t end = text.find(']');
    if (end != std::string_view::npos) in_brackets_ = false;
    text = text.substr(0, end);
    while (!text.empty()) {
      const std::size_t comma = std::min(text.find(','), text.size());
      std::string item = unquoted(text.substr(0, comma));
      if (!item.empty()) list_->push_back(std::move(item));
      text.remove_prefix(std::min(comma + 1, text.size()));
    }
  }

  CustomTopics& found_;
  std::vector<Key> path_;
  std::vector<std::string>* list_ = nullptr;  ///< of the `vars` whose items follow
  bool in_brackets_ = false;
};

/// Returns the path of the crazyflies.yaml that belongs to the log; empty if there is none.
fs::path yaml_beside(const std::string& log) {
  std::error_code error;
  const fs::path path = fs::absolute(log, error).lexically_normal();
  const fs::path folder = fs::is_directory(path, error) ? path : path.parent_path();
  for (const fs::path& place :
       {folder, folder / "config", folder.parent_path(), folder.parent_path() / "config"}) {
    if (fs::is_regular_file(place / "crazyflies.yaml", error)) return place / "crazyflies.yaml";
  }
  return {};
}

bool is_generic(const RawTopic& topic) {
  return topic.type.find("LogDataGeneric") != std::string::npos && topic.find("values[0]") != nullptr;
}

/// Returns an empty text if the names fit, else the reason why they do not.
std::string rename_values(RawTopic& topic, const std::vector<std::string>& variables) {
  if (variables.empty()) return "does not name the values of " + topic.name;
  std::vector<RawColumn*> values;
  for (RawColumn& column : topic.columns)
    if (column.name.rfind("values[", 0) == 0) values.push_back(&column);
  if (values.size() != variables.size())
    return fmt::format("names {} variables of {}, which has {} values", variables.size(), topic.name,
                       values.size());
  for (std::size_t i = 0; i < values.size(); ++i) values[i]->name = variables[i];
  return "";
}

}  // namespace

std::vector<std::string> CustomTopics::variables(const std::string& topic) const {
  const std::size_t slash = topic.rfind('/');
  if (slash == std::string::npos) return {};
  const std::string space = topic.substr(0, slash), robot = space.substr(space.rfind('/') + 1);
  const auto type = type_of_robot.find(robot);
  for (const std::string& owner :
       {"robots/" + robot, type == type_of_robot.end() ? "" : "robot_types/" + type->second,
        std::string("all")}) {
    const auto found = named.find({owner, topic.substr(slash + 1)});
    if (found != named.end()) return found->second;
  }
  return {};
}

CustomTopics parse_custom_topics(std::string_view yaml) {
  CustomTopics found;
  YamlReader reader(found);
  for (std::size_t at = 0; at < yaml.size();) reader.line(take_text_line(yaml, at));
  return found;
}

std::vector<std::string> name_variables(RawLog& log) {
  std::vector<std::string> notes;
  if (std::none_of(log.topics.begin(), log.topics.end(), is_generic)) return notes;
  const fs::path path = yaml_beside(log.path);
  if (path.empty()) {
    notes.emplace_back(
        "the values of LogDataGeneric have no names here: put crazyflies.yaml into the folder of the log");
    return notes;
  }
  CustomTopics topics;
  try {
    topics = parse_custom_topics(files::read_file(path.string(), kLargestYaml_bytes));
  } catch (const files::InputError& error) {
    notes.push_back("crazyflies.yaml in the folder of the log " + error.fault().what);
    return notes;
  }
  for (RawTopic& topic : log.topics) {
    if (!is_generic(topic)) continue;
    const std::string fault = rename_values(topic, topics.variables(topic.name));
    notes.push_back(fault.empty() ? "the values of " + topic.name + " are named by crazyflies.yaml"
                                  : "crazyflies.yaml " + fault);
  }
  return notes;
}

}  // namespace swarmcert::logs
