/// @file Messages of one ROS 2 topic as columns.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "analysis/logs/formats/ros_types.h"
#include "analysis/logs/raw_log.h"

namespace swarmcert::logs {

/// What the messages of a topic look like.
struct RosLayout {
  std::string type;  ///< long name, for RawTopic
  /// One, or versions that differ in the types of numbers only: a message is of the one whose size it has.
  std::vector<RosSchema> versions;
  bool is_beginning = false;  ///< messages go on behind what the schema describes
};

/// The layout of messages of `type`. A definition from the file is preferred to one of ros_messages.h.
/// @param text the file's definition, empty if it has none. Where there is no layout,
/// nullptr and why in `fault`.
std::shared_ptr<const RosLayout> ros_layout(const std::string& type, std::string_view text,
                                            std::string& fault);

/// What all topics of a log may need together: compressed files can hold far more than their size lets expect.
struct RosBudget {
  std::size_t places = std::size_t{1} << 20;  ///< fields and elements of arrays
  std::size_t values = std::size_t{1} << 28;  ///< numbers: 2 GiB
};

/// Turns serialized messages (CDR of both byte orders, versions 1 and 2) into a RawTopic.
///
/// Columns are named `pose.position.x`, `covariance[3]`; a stamp is one column in seconds. Where arrays vary in length,
/// a column is NaN in messages that lack the element. Arrays over kMostElements are left out. An array of messages that
/// carry a text `name` or `child_frame_id` (TFMessage, NamedPoseArray) becomes a topic for each name: "/tf[cf1]".
class RosTopic {
 public:
  /// @param budget must outlive this
  RosTopic(std::string name, std::shared_ptr<const RosLayout> layout, RosBudget& budget);
  ~RosTopic();
  RosTopic(RosTopic&&) noexcept;

  /// False if `message` does not have the form that the layout says; nothing is kept of it then.
  bool add(double time_s, std::string_view message);
  /// Moves what was gathered to `log`, with what was left out.
  void move_to(RawLog& log);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// A topic of a file, or why its messages cannot be read.
struct FoundTopic {
  std::optional<RosTopic> topic;
  std::string name, fault;
  std::size_t lost = 0;  ///< messages that were not read

  /// Moves what was gathered to `log`, or notes there what was lost and why. `id` stands for an empty name.
  void move_to(RawLog& log, const std::string& id);
};

/// Topics of one name become instances 0, 1, ... of it.
void number_instances(RawLog& log);

}  // namespace swarmcert::logs
