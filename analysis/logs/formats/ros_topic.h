/// @file Turns the messages of one ROS 2 topic into columns.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "analysis/logs/formats/ros_types.h"
#include "analysis/logs/raw_log.h"

namespace swarmcert::logs {

/// Layout of the messages of a topic.
struct RosLayout {
  std::string type;  ///< long name, for RawTopic
  /// One schema, or versions that differ only in their number types; the size of a message selects the version.
  std::vector<RosSchema> versions;
  bool is_beginning = false;  ///< messages continue after what the schema describes
};

/// Returns the layout of messages of `type`, preferably from the file's definition, else built in. Returns
/// nullptr and sets `fault` if there is none.
/// @param text the file's definition; empty if it has none
std::shared_ptr<const RosLayout> ros_layout(const std::string& type, std::string_view text,
                                            std::string& fault);

/// Layouts, and limits of the memory, of all topics of a log together; compressed files can hold far more than their size suggests.
struct RosBudget {
  std::size_t places = std::size_t{1} << 20;  ///< fields and array elements
  std::size_t values = std::size_t{1} << 28;  ///< numbers: 2 GiB
  /// By type and definition, each parsed once; with the fault where there is none.
  std::map<std::pair<std::string, std::string_view>, std::pair<std::shared_ptr<const RosLayout>, std::string>>
      layouts{};
};

/// Turns serialized messages (CDR in either byte order, versions 1 and 2) into a RawTopic.
///
/// Columns are named `pose.position.x`, `covariance[3]`; a stamp is one column in seconds. If arrays vary in length, a
/// column is NaN in messages that lack the element. Arrays longer than kMostElements are skipped. An array of messages
/// that have a text field `name` or `child_frame_id` (TFMessage, NamedPoseArray) becomes one topic per name:
/// "/tf[cf1]".
class RosTopic {
 public:
  /// @param budget must outlive this object
  RosTopic(std::string name, std::shared_ptr<const RosLayout> layout, RosBudget& budget);
  ~RosTopic();
  RosTopic(RosTopic&&) noexcept;

  /// Returns false, and keeps nothing, if `message` does not match the layout.
  bool add(double time_s, std::string_view message);
  /// Moves the collected columns to `log`, with a list of what was left out.
  void move_to(RawLog& log);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// A topic of a file, or the reason why its messages cannot be read.
struct FoundTopic {
  std::optional<RosTopic> topic;
  std::string name, fault;
  std::size_t lost = 0;  ///< messages that were not read

  /// Moves the collected columns to `log`, or notes there what was lost and why. `id` replaces an empty name.
  void move_to(RawLog& log, const std::string& id);
};

/// Begins a topic; its messages are known only in the encoding "cdr".
/// @param type, text as for ros_layout()
FoundTopic found_topic(const std::string& name, const std::string& encoding, const std::string& type,
                       std::string_view text, RosBudget& budget);

/// Numbers topics of the same name as its instances 0, 1, ...
void number_instances(RawLog& log);

}  // namespace swarmcert::logs
