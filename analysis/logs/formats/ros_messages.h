/// @file Built-in definitions of common ROS 2 messages, for bags that do not contain them.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace swarmcert::logs {

/// A definition in the syntax of `.msg` files.
struct RosMessageText {
  std::string_view text;
  /// The definition covers only the first fields, which all versions of the message share; the rest is not read.
  bool is_beginning = false;
};

/// Returns the built-in definitions of `name` ("geometry_msgs/Pose"); empty if there is none. Several definitions are
/// versions of the message that differ only in their number types; the size of a message selects one.
std::vector<RosMessageText> builtin_ros_definitions(const std::string& name);

}  // namespace swarmcert::logs
