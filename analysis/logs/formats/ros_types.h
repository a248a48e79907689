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
  kStamp,  ///< builtin_interfaces/Time or Duration; becomes one number in seconds
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

/// A message type with all the types it uses; types[0] is the message itself. No type contains itself and the nesting
/// depth is limited, so a decoder may recurse.
struct RosSchema {
  std::vector<RosType> types;
};

/// Layout of the messages of a topic.
struct RosLayout {
  std::string type;  ///< long name, for RawTopic
  /// One schema, or versions that differ only in their number types; the size of a message selects the version.
  std::vector<RosSchema> versions;
  bool is_beginning = false;  ///< messages continue after what the schema describes
};

/// Result of parsing a definition: the schema, or why it cannot be used.
struct RosDefinition {
  std::optional<RosSchema> schema;
  std::string fault;
};

/// Returns "geometry_msgs/Pose" for both "geometry_msgs/msg/Pose" and "geometry_msgs/Pose".
std::string short_type_name(std::string_view name);
/// Returns "geometry_msgs/msg/Pose" for both.
std::string long_type_name(std::string_view name);

/// A definition in the syntax of `.msg` files.
struct RosMessageText {
  std::string_view text;
  /// The definition covers only the first fields, which all versions of the message share; the rest is not read.
  bool is_beginning = false;
};

/// Returns the built-in definitions of `name` ("geometry_msgs/Pose"); an empty list if it is unknown. Several are
/// versions of the message that differ only in their number types; the size of a message selects one.
std::vector<RosMessageText> builtin_ros_definitions(const std::string& name);

/// Parses a message definition.
/// @param name type of the message
/// @param text its definition, followed by the definitions it uses, each after a line of "=" and a line "MSG:
///   package/Type". Types missing from the text are built in (dictionary/ros_messages.msg).
RosDefinition parse_ros_definition(const std::string& name, std::string_view text);

}  // namespace swarmcert::logs
