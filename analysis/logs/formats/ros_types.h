/// @file ROS 2 message definitions (`.msg`, "ros2msg" in MCAP) as trees of types.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "analysis/logs/formats/bytes.h"

namespace swarmcert::logs {

inline constexpr std::size_t kLongestDefinition_bytes = std::size_t{1} << 20;

enum class RosKind : unsigned char {
  kNumber,
  kText,
  kStamp,  ///< builtin_interfaces/Time and Duration: seconds and nanoseconds, one number in seconds here
  kMessage
};
enum class RosArray : unsigned char { kNone, kFixed, kSequence };

struct RosField {
  std::string name;
  RosKind kind = RosKind::kNumber;
  Scalar number = Scalar::kUint8;  ///< of kNumber
  std::size_t message = 0;         ///< of kMessage: in RosSchema::types
  RosArray array = RosArray::kNone;
  std::size_t count = 1;  ///< of kFixed, at least 1
};

struct RosType {
  std::string name;              ///< "geometry_msgs/Pose"
  std::vector<RosField> fields;  ///< never empty: a message without fields is sent as one byte
};

/// A message type with all types that it uses; types[0] is the message. No type contains itself, and nesting is
/// limited, so that a decoder may recurse.
struct RosSchema {
  std::vector<RosType> types;
};

/// What became of a definition: the schema, or why it cannot be used.
struct RosDefinition {
  std::optional<RosSchema> schema;
  std::string fault;
};

/// "geometry_msgs/msg/Pose" and "geometry_msgs/Pose" as the latter.
std::string short_type_name(std::string_view name);
/// Both as the former.
std::string long_type_name(std::string_view name);

/// @param name of the message's type. @param text its definition, followed by those that it uses, each after a line of
///   "=" and a line "MSG: package/Type". Types that the text lacks are taken from ros_messages.h.
RosDefinition parse_ros_definition(const std::string& name, std::string_view text);

}  // namespace swarmcert::logs
