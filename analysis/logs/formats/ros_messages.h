/// @file Definitions of ROS 2 messages that flights use, for bags that do not carry them.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace swarmcert::logs {

/// A definition in the language of `.msg` files.
struct RosMessageText {
  std::string_view text;
  /// The first fields, which all versions of the message share; what follows them differs and is not read.
  bool is_beginning = false;
};

/// What is known here of `name` ("geometry_msgs/Pose"); empty if nothing. Several: versions of the message that differ
/// in their numbers' types only; the size of a message says which it is.
std::vector<RosMessageText> builtin_ros_definitions(const std::string& name);

}  // namespace swarmcert::logs
