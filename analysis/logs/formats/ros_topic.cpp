#include "analysis/logs/formats/ros_topic.h"

#include <fmt/core.h>

#include <set>

#include "analysis/logs/formats/cdr.h"
#include "analysis/logs/formats/column_table.h"

namespace swarmcert::logs {
namespace {

constexpr std::size_t kMostNames = 1024;

/// Returns the text field of `type` that names the elements of an array of this type.
std::optional<std::size_t> naming_field(const RosType& type) {
  for (std::size_t i = 0; i < type.fields.size(); ++i) {
    const RosField& field = type.fields[i];
    const bool is_text = field.kind == RosKind::kText && field.array == RosArray::kNone;
    if (is_text && (field.name == "name" || field.name == "child_frame_id")) return i;
  }
  return std::nullopt;
}

}  // namespace

struct RosTopic::State {
  State(std::string topic_name, std::shared_ptr<const RosLayout> topic_layout, RosBudget& topic_budget)
      : name(std::move(topic_name)),
        layout(std::move(topic_layout)),
        budget(topic_budget),
        main(name, layout->type, budget) {}

  /// A record for the topic of an element of a named array.
  struct NamedRecord {
    ColumnTable* table;
    RosRecord record;
    std::size_t bytes;
  };

  const std::string name;
  const std::shared_ptr<const RosLayout> layout;
  RosBudget& budget;
  ColumnTable main;
  std::map<std::string, ColumnTable> named;
  std::set<std::string> large_arrays;
  std::size_t version = 0, malformed = 0;
  // State of the message being read.
  const RosSchema* schema = nullptr;
  CdrCursor cursor;
  std::vector<NamedRecord> named_records;

  bool read_value(const RosField& field, ColumnTable& table, RosNode* node, RosRecord& record) {
    if (field.kind == RosKind::kMessage) return read_message(field.message, table, node, record);
    if (field.kind == RosKind::kText) {
      std::string_view text;
      if (!cursor.read_text(text)) return false;
      if (node != nullptr) record.texts.emplace_back(node, text);
      return true;
    }
    double value = 0;
    if (field.kind == RosKind::kStamp) {
      double nanoseconds = 0;
      if (!cursor.read(Scalar::kInt32, value) || !cursor.read(Scalar::kUint32, nanoseconds)) return false;
      value += nanoseconds / 1e9;
      if (node != nullptr) node->is_stamp = true;
    } else if (!cursor.read(field.number, value)) {
      return false;
    }
    if (node != nullptr) record.numbers.emplace_back(node, value);
    return true;
  }

  /// @param node of the array, nullptr if its elements are skipped
  bool read_array(const RosField& field, ColumnTable& table, RosNode* node, RosRecord& record) {
    std::size_t count = field.count;
    if (field.array == RosArray::kSequence && !cursor.read_count(count)) return false;
    if (count > kMostElements) {
      if (node != nullptr && large_arrays.size() < kMostElements) large_arrays.insert(node->name());
      node = nullptr;
    }
    if (node == nullptr && field.kind == RosKind::kNumber) return cursor.skip(field.number, count);
    // Each element has at least one byte, so an impossible count stops at the end of the message.
    for (std::size_t i = 0; i < count; ++i)
      if (!read_value(field, table, table.child(node, i, nullptr), record)) return false;
    return true;
  }

  /// @param node of the message, nullptr if it is skipped
  bool read_message(std::size_t type, ColumnTable& table, RosNode* node, RosRecord& record) {
    const std::vector<RosField>& fields = schema->types[type].fields;
    for (std::size_t i = 0; i < fields.size(); ++i) {
      const RosField& field = fields[i];
      const bool is_top = &table == &main && node == main.root();
      if (is_top && field.array != RosArray::kNone && field.kind == RosKind::kMessage &&
          naming_field(schema->types[field.message])) {
        if (!read_named_array(field)) return false;
        continue;
      }
      RosNode* const child = table.child(node, i, &field.name);
      const bool is_read = field.array == RosArray::kNone ? read_value(field, table, child, record)
                                                          : read_array(field, table, child, record);
      if (!is_read) return false;
    }
    return true;
  }

  bool read_named_array(const RosField& field) {
    std::size_t count = field.count;
    if (field.array == RosArray::kSequence && !cursor.read_count(count)) return false;
    for (std::size_t i = 0; i < count; ++i) {
      const CdrCursor start = cursor;
      std::string_view element_name;
      RosRecord nothing;
      const std::vector<RosField>& fields = schema->types[field.message].fields;
      const std::size_t naming = *naming_field(schema->types[field.message]);
      for (std::size_t k = 0; k < naming; ++k) {
        const bool is_array = fields[k].array != RosArray::kNone;
        if (!(is_array ? read_array(fields[k], main, nullptr, nothing)
                       : read_value(fields[k], main, nullptr, nothing)))
          return false;
      }
      if (!cursor.read_text(element_name)) return false;
      cursor = start;
      ColumnTable* const table = table_of(element_name, schema->types[field.message].name);
      NamedRecord element{table, {}, cursor.left()};
      if (!read_message(field.message, table != nullptr ? *table : main,
                        table != nullptr ? table->root() : nullptr, element.record))
        return false;
      element.bytes -= cursor.left();
      if (table != nullptr) named_records.push_back(std::move(element));
    }
    return true;
  }

  /// Returns nullptr if there are too many names.
  ColumnTable* table_of(std::string_view element_name, const std::string& type) {
    const std::string full = name + "[" + std::string(element_name.substr(0, 128)) + "]";
    const auto found = named.find(full);
    if (found != named.end()) return &found->second;
    if (named.size() >= kMostNames) return nullptr;
    return &named.emplace(full, ColumnTable(full, long_type_name(type), budget)).first->second;
  }

  bool read_version(std::size_t index, std::string_view message, RosRecord& record) {
    schema = &layout->versions[index];
    named_records.clear();
    record = {};
    constexpr std::size_t kMostPadding_bytes = 3;
    return cursor.begin(message) && read_message(0, main, main.root(), record) &&
           (layout->is_beginning || cursor.left() <= kMostPadding_bytes);
  }
};

std::shared_ptr<const RosLayout> ros_layout(const std::string& type, std::string_view text,
                                            std::string& fault) {
  auto layout = std::make_shared<RosLayout>();
  layout->type = long_type_name(type);
  std::vector<RosMessageText> texts = {{text, false}};
  if (text.empty()) texts = builtin_ros_definitions(short_type_name(type));
  if (texts.empty()) fault = "neither the file nor this program defines its type " + layout->type;
  for (const RosMessageText& each : texts) {
    RosDefinition definition = parse_ros_definition(type, each.text);
    if (definition.schema) layout->versions.push_back(std::move(*definition.schema));
    if (!definition.schema) fault = definition.fault;
    layout->is_beginning = each.is_beginning;
  }
  return layout->versions.empty() ? nullptr : layout;
}

RosTopic::RosTopic(std::string name, std::shared_ptr<const RosLayout> layout, RosBudget& budget)
    : state_(std::make_unique<State>(std::move(name), std::move(layout), budget)) {}
RosTopic::~RosTopic() = default;
RosTopic::RosTopic(RosTopic&&) noexcept = default;

bool RosTopic::add(double time_s, std::string_view message) {
  State& s = *state_;
  RosRecord record;
  bool is_read = s.read_version(s.version, message, record);
  for (std::size_t i = 0; !is_read && i < s.layout->versions.size(); ++i) {
    is_read = s.read_version(i, message, record);
    if (is_read) s.version = i;
  }
  if (!is_read) {
    ++s.malformed;
    return false;
  }
  s.main.add(time_s, record, message.size());
  for (const State::NamedRecord& element : s.named_records)
    element.table->add(time_s, element.record, element.bytes);
  return true;
}

void RosTopic::move_to(RawLog& log) {
  State& s = *state_;
  s.main.move_to(log, !s.named.empty());
  for (auto& [name, table] : s.named) table.move_to(log, false);
  for (const std::string& array : s.large_arrays)
    log.skipped.push_back(
        {s.name + "." + array, fmt::format("it has more than {} elements", kMostElements), 0});
  if (s.malformed > 0) {
    log.health.damaged_blocks += s.malformed;
    log.skipped.push_back({s.name, "messages do not match the definition of their type", s.malformed});
  }
}

void FoundTopic::move_to(RawLog& log, const std::string& id) {
  if (topic)
    topic->move_to(log);
  else
    log.skipped.push_back({name.empty() ? id : name, fault, lost});
}

FoundTopic found_topic(const std::string& name, const std::string& encoding, const std::string& type,
                       std::string_view text, RosBudget& budget) {
  FoundTopic found;
  found.name = name;
  if (encoding != "cdr") {
    found.fault = "its messages have the encoding \"" + encoding.substr(0, 64) + "\", known is \"cdr\"";
    return found;
  }
  const auto [known, is_new] = budget.layouts.try_emplace({type, text});
  auto& [layout, fault] = known->second;
  if (is_new) layout = ros_layout(type, text, fault);
  found.fault = fault;
  if (layout) found.topic.emplace(name, layout, budget);
  return found;
}

void number_instances(RawLog& log) {
  std::map<std::string, int> counts;
  for (RawTopic& topic : log.topics) topic.instance = counts[topic.name]++;
}

}  // namespace swarmcert::logs
