/// @file What files beside a log say of its columns: crazyflies.yaml names the values of Crazyswarm2's LogDataGeneric.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "analysis/logs/raw_log.h"

namespace swarmcert::logs {

/// Log variables of the custom topics of a crazyflies.yaml.
struct CustomTopics {
  using Variables =
      std::map<std::string, std::vector<std::string>>;  ///< by topic, in the order of the values
  std::map<std::string, Variables> of_robot, of_type;
  std::map<std::string, std::string> type_of_robot;
  Variables of_all;

  /// The variables of "/<robot>/<topic>": as the robot, else its type, else the section of all robots states them.
  /// Empty where none does.
  std::vector<std::string> variables(const std::string& topic) const;
};

/// Reads `robots`, `robot_types` and `all` of a crazyflies.yaml, at any depth. Lines that do not fit are passed over:
/// the file belongs to another program.
CustomTopics parse_custom_topics(std::string_view yaml);

/// Renames the columns `values[i]` of LogDataGeneric topics where a crazyflies.yaml beside the log names as many
/// variables as the topic has values. The file is sought in the folder of the log, the one above, and in `config` below
/// both.
/// @return for people: which topics were named, and why others were not. Empty where the log has none of that type.
std::vector<std::string> name_variables(RawLog& log);

}  // namespace swarmcert::logs
