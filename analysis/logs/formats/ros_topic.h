/// @file Turns the messages of one ROS 2 topic into columns.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "analysis/logs/formats/cdr.h"
#include "analysis/logs/formats/column_table.h"

namespace swarmcert::logs {

/// Returns the layout of messages of `type`, preferably from the file's definition, else built in. Returns
/// nullptr and sets `fault` if there is none.
/// @param text the file's definition; empty if it has none
std::shared_ptr<const RosLayout> ros_layout(const std::string& type, std::string_view text,
                                            std::string& fault);

/// Turns serialized messages (CDR in either byte order, versions 1 and 2) into a RawTopic.
///
/// Columns are named `pose.position.x`, `covariance[3]`; a stamp is one column in seconds. If arrays vary in length, a
/// column is NaN in messages that lack the element. Arrays longer than kMostElements are skipped. An array of messages
/// that have a text field `name` or `child_frame_id` (TFMessage, NamedPoseArray) becomes one topic per name:
/// "/tf[cf1]".
class RosTopic {
 public:
  /// @param budget must outlive this object
  RosTopic(const std::string& name, std::shared_ptr<const RosLayout> layout, RosBudget& budget)
      : name_(name), layout_(std::move(layout)), budget_(budget), main_(name, layout_->type, budget) {}

  /// Returns false, and keeps nothing, if `message` does not match the layout.
  bool add(double time_s, std::string_view message);
  /// Moves the collected columns to `log`, with a list of what was left out.
  void move_to(RawLog& log);

 private:
  /// A record for the topic of an element of a named array.
  struct NamedRecord {
    ColumnTable* table;
    RosRecord record;
    std::size_t bytes;
  };

  bool read_version(std::size_t index, std::string_view message, RosRecord& record);
  bool read_message(std::size_t type, ColumnTable& table, RosNode* node, RosRecord& record);
  bool read_field(const RosField& field, ColumnTable& table, RosNode* node, RosRecord& record);
  bool read_value(const RosField& field, ColumnTable& table, RosNode* node, RosRecord& record);
  bool read_named_array(const RosField& field);
  ColumnTable* table_of(std::string_view element_name, const std::string& type);

  const std::string name_;
  const std::shared_ptr<const RosLayout> layout_;
  RosBudget& budget_;
  ColumnTable main_;
  std::map<std::string, ColumnTable> named_;
  std::set<std::string> large_arrays_;
  std::size_t version_ = 0, malformed_ = 0;
  // Of the message being read.
  const RosSchema* schema_ = nullptr;
  CdrCursor cursor_;
  std::vector<NamedRecord> named_records_;
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
