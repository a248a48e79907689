/// @file Column names from files beside a log: crazyflies.yaml names the values of Crazyswarm2's LogDataGeneric.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "analysis/logs/raw_log.h"

namespace swarmcert::logs {

/// Receives the keys above a value, outermost first, and the value.
using YamlUse = std::function<void(const std::vector<std::string>& keys, const std::string& value)>;

/// Goes through the values of a YAML file, lists element by element: nested mappings, lists in brackets and of dashes.
/// Lines of any other form are ignored, because the file belongs to another program.
void for_each_value(std::string_view yaml, const YamlUse& use);

/// Log variables of the custom topics in a crazyflies.yaml.
struct CustomTopics {
  /// In the order of the values, by owner ("robots/cf1", "robot_types/heavy", "all") and topic.
  std::map<std::pair<std::string, std::string>, std::vector<std::string>> named;
  std::map<std::string, std::string> type_of_robot;

  /// Returns the variables of "/<robot>/<topic>" as defined for the robot, else for its type, else for all robots.
  /// Empty if not defined.
  std::vector<std::string> variables(const std::string& topic) const;
};

/// Reads `robots`, `robot_types` and `all` of a crazyflies.yaml at any depth.
CustomTopics parse_custom_topics(std::string_view yaml);

/// Renames the columns `values[i]` of LogDataGeneric topics if a crazyflies.yaml beside the log names as many variables
/// as the topic has values. The file is searched for in the folder of the log, its parent, and `config` below either.
/// @return which topics were named, and why others were not, in words; empty if the log has no such topic
std::vector<std::string> name_variables(RawLog& log);

}  // namespace swarmcert::logs
