#include "analysis/logs/variable_names.h"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>

#include "analysis/logs/csv.h"
#include "nn/base/csv.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "nn/base/text.h"

namespace swarmcert::logs {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLargestYaml_bytes = std::size_t{1} << 20;

/// Returns `text` without blanks and quotes around it.
std::string unquoted(std::string_view text) {
  text = files::without_blanks(text);
  const bool is_quoted = text.size() >= 2 && text.front() == '\'' && text.back() == '\'';
  return std::string(is_quoted ? text.substr(1, text.size() - 2) : text);
}

std::string_view before_comment(std::string_view line) {
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '#' && (i == 0 || line[i - 1] == ' ' || line[i - 1] == '\t')) return line.substr(0, i);
  }
  return line;
}

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

void for_each_value(std::string_view yaml, const YamlUse& use) {
  std::vector<std::size_t> indents;
  std::vector<std::string> keys;
  bool in_brackets = false;
  for (std::size_t at = 0; at < yaml.size();) {
    std::string_view text = before_comment(take_text_line(yaml, at));
    const std::size_t indent = std::min(text.find_first_not_of(' '), text.size());
    text.remove_prefix(indent);
    const bool is_item = !in_brackets && (text.substr(0, 2) == "- " || text == "-");
    if (is_item) {
      text.remove_prefix(1);
    } else if (!in_brackets) {
      const std::size_t colon = text.find(':');
      if (colon == std::string_view::npos) continue;
      for (; !indents.empty() && indents.back() >= indent; indents.pop_back()) keys.pop_back();
      indents.push_back(indent);
      keys.push_back(unquoted(text.substr(0, colon)));
      text.remove_prefix(std::min(text.find_first_not_of(" \t", colon + 1), text.size()));
      in_brackets = text.substr(0, 1) == "[";
      if (in_brackets) text.remove_prefix(1);
    }
    const std::size_t end = in_brackets ? text.find(']') : std::string_view::npos;
    for (const std::string& part :
         in_brackets ? files::split_at_commas(text.substr(0, end)) : std::vector{std::string(text)})
      if (std::string value = unquoted(part); !value.empty()) use(keys, value);
    if (end != std::string_view::npos) in_brackets = false;
  }
}

CustomTopics parse_custom_topics(std::string_view yaml) {
  CustomTopics found;
  for_each_value(yaml, [&](const std::vector<std::string>& keys, const std::string& value) {
    const std::size_t depth = keys.size();
    const auto below = [&](const char* section) {
      const auto at = std::find(keys.begin(), keys.end(), section);
      return keys.end() - at < 2 ? std::string() : at[1];
    };
    const std::string robot = below("robots"), type = below("robot_types");
    if (depth > 1 && keys[depth - 1] == "type" && keys[depth - 2] == robot)
      found.type_of_robot[robot] = value;
    if (depth < 3 || keys[depth - 1] != "vars" || keys[depth - 3] != "custom_topics") return;
    const std::string owner = !robot.empty()  ? "robots/" + robot
                              : !type.empty() ? "robot_types/" + type
                                              : "all";
    found.named[{owner, keys[depth - 2]}].push_back(value);
  });
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
