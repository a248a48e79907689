/// @file Builds columns message by message; arrays may vary in length.
#pragma once

#include <fmt/core.h>

#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "analysis/logs/formats/ros_types.h"
#include "analysis/logs/raw_log.h"
#include "analysis/logs/statistics_of_series.h"

namespace swarmcert::logs {

/// Layouts, and limits of the memory, of all topics of a log together; compressed files can hold far more than their
/// size suggests.
struct RosBudget {
  std::size_t places = std::size_t{1} << 20;  ///< fields and array elements
  std::size_t values = std::size_t{1} << 28;  ///< numbers: 2 GiB
  /// By type and definition, each parsed once: the layout, or null and the reason why there is none.
  std::map<std::pair<std::string, std::string_view>, std::pair<std::shared_ptr<const RosLayout>, std::string>>
      layouts{};
};

/// A field of a message or an element of an array. Caches its column, so that the column's name is built only once.
struct RosNode {
  const RosNode* parent = nullptr;
  std::string label;  ///< ".x", "[3]"
  std::optional<std::size_t> column;
  std::vector<std::unique_ptr<RosNode>> children;

  std::string name() const {
    if (parent == nullptr) return "";
    const std::string before = parent->name();
    return before.empty() && !label.empty() && label[0] == '.' ? label.substr(1) : before + label;
  }
};

/// The values of one message, held back until the whole message has been checked.
using RosRecord = std::vector<std::pair<RosNode*, double>>;

/// A RawTopic under construction.
class ColumnTable {
 public:
  ColumnTable(const std::string& name, const std::string& type, RosBudget& budget) : budget_(budget) {
    topic_.name = name;
    topic_.type = type;
  }

  RosNode* root() { return &root_; }

  /// Returns the child of `parent`; nullptr if `parent` is nullptr or there are too many nodes.
  /// @param field name of the child; nullptr for an array element, which is labelled with its index
  RosNode* child(RosNode* parent, std::size_t index, const std::string* field) {
    if (parent == nullptr) return nullptr;
    if (parent->children.size() <= index) parent->children.resize(index + 1);
    std::unique_ptr<RosNode>& child = parent->children[index];
    if (!child) {
      if (places_ >= kMostPlaces || budget_.places == 0) {
        has_too_many_columns_ = true;
        return nullptr;
      }
      ++places_;
      --budget_.places;
      child = std::make_unique<RosNode>();
      child->parent = parent;
      child->label = field != nullptr ? "." + *field : "[" + std::to_string(index) + "]";
    }
    return child.get();
  }

  void add(double time_s, const RosRecord& record, std::size_t message_bytes) {
    bytes_ += message_bytes;
    ++records_;
    if (!given_up_.empty()) return;
    const std::size_t row = topic_.time_s.size();
    topic_.time_s.push_back(time_s);
    for (const auto& [node, value] : record) {
      if (!node->column) node->column = new_column(*node, row);
      if (*node->column < topic_.columns.size()) topic_.columns[*node->column].values.push_back(value);
    }
    for (RawColumn& column : topic_.columns)
      if (column.values.size() == row) column.values.push_back(kNaN);
    limit_values();
  }

  /// Moves the topic to `log`.
  /// @param has_elements part of the messages went to topics of its own, so this topic may be empty
  void move_to(RawLog& log, bool has_elements) {
    if (!given_up_.empty()) {
      log.left_out.push_back({topic_.name, given_up_, records_});
      return;
    }
    if (has_too_many_columns_)
      log.left_out.push_back(
          {topic_.name, fmt::format("only its first {} numbers are kept", topic_.columns.size()), 0});
    if (topic_.time_s.empty() || (has_elements && topic_.columns.empty())) return;
    log.health.records += topic_.time_s.size();
    log.topics.push_back(std::move(topic_));
  }

 private:
  static constexpr std::size_t kMostPlaces = 4 * kMostColumns;

  /// Returns the index of the new column; an out-of-range index if there are too many columns.
  std::size_t new_column(const RosNode& node, std::size_t row) {
    if (topic_.columns.size() >= kMostColumns) {
      has_too_many_columns_ = true;
      return std::numeric_limits<std::size_t>::max();
    }
    topic_.columns.push_back({node.name(), std::vector<double>(row, kNaN)});
    return topic_.columns.size() - 1;
  }

  /// Bounds the memory: one long message among many short ones would add columns with a value for each message.
  void limit_values() {
    constexpr std::size_t kMostMissing = std::size_t{1} << 16;
    constexpr std::size_t kMostPerByte = 8;
    const std::size_t values = (topic_.columns.size() + 1) * topic_.time_s.size();
    const std::size_t more = values - values_;
    values_ = values;
    if (values > kMostMissing + kMostPerByte * bytes_)
      given_up_ = "its arrays vary too much in length to be columns";
    if (more > budget_.values) given_up_ = "the log contains more numbers than the memory limit allows";
    if (given_up_.empty()) {
      budget_.values -= more;
      return;
    }
    budget_.values += values - more;
    topic_.time_s = {};
    topic_.columns = {};
  }

  RosBudget& budget_;
  RawTopic topic_;
  RosNode root_;
  std::size_t places_ = 0, values_ = 0, bytes_ = 0, records_ = 0;
  bool has_too_many_columns_ = false;
  std::string given_up_;  ///< why no columns are kept
};

}  // namespace swarmcert::logs
