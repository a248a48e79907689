#include "analysis/logs/formats/ros_topic.h"

#include <fmt/core.h>

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

bool RosTopic::read_value(const RosField& field, ColumnTable& table, RosNode* node, RosRecord& record) {
  if (field.kind == RosKind::kMessage) return read_message(field.message, table, node, record);
  if (field.kind == RosKind::kText) {
    std::string_view text;
    return cursor_.read_text(text);
  }
  double value = 0;
  if (field.kind == RosKind::kStamp) {
    double nanoseconds = 0;
    if (!cursor_.read(Scalar::kInt32, value) || !cursor_.read(Scalar::kUint32, nanoseconds)) return false;
    value += nanoseconds / 1e9;
  } else if (!cursor_.read(field.number, value)) {
    return false;
  }
  if (node != nullptr) record.emplace_back(node, value);
  return true;
}

/// @param node of the value or array, nullptr if it is skipped
bool RosTopic::read_field(const RosField& field, ColumnTable& table, RosNode* node, RosRecord& record) {
  if (field.array == RosArray::kNone) return read_value(field, table, node, record);
  std::size_t count = field.count;
  if (field.array == RosArray::kSequence && !cursor_.read_count(count)) return false;
  if (count > kMostElements) {
    if (node != nullptr && large_arrays_.size() < kMostElements) large_arrays_.insert(node->name());
    node = nullptr;
  }
  if (node == nullptr && field.kind == RosKind::kNumber) return cursor_.skip(field.number, count);
  // Each element has at least one byte, so an impossible count stops at the end of the message.
  for (std::size_t i = 0; i < count; ++i)
    if (!read_value(field, table, table.child(node, i, nullptr), record)) return false;
  return true;
}

/// @param node of the message, nullptr if it is skipped
bool RosTopic::read_message(std::size_t type, ColumnTable& table, RosNode* node, RosRecord& record) {
  const std::vector<RosField>& fields = schema_->types[type].fields;
  for (std::size_t i = 0; i < fields.size(); ++i) {
    const RosField& field = fields[i];
    const bool is_top = &table == &main_ && node == main_.root();
    if (is_top && field.array != RosArray::kNone && field.kind == RosKind::kMessage &&
        naming_field(schema_->types[field.message])) {
      if (!read_named_array(field)) return false;
      continue;
    }
    RosNode* const child = table.child(node, i, &field.name);
    if (!read_field(field, table, child, record)) return false;
  }
  return true;
}

bool RosTopic::read_named_array(const RosField& field) {
  std::size_t count = field.count;
  if (field.array == RosArray::kSequence && !cursor_.read_count(count)) return false;
  for (std::size_t i = 0; i < count; ++i) {
    const CdrCursor start = cursor_;
    std::string_view element_name;
    RosRecord nothing;
    const std::vector<RosField>& fields = schema_->types[field.message].fields;
    const std::size_t naming = *naming_field(schema_->types[field.message]);
    for (std::size_t k = 0; k < naming; ++k)
      if (!read_field(fields[k], main_, nullptr, nothing)) return false;
    if (!cursor_.read_text(element_name)) return false;
    cursor_ = start;
    ColumnTable* const table = table_of(element_name, schema_->types[field.message].name);
    NamedRecord element{table, {}, cursor_.left()};
    if (!read_message(field.message, table != nullptr ? *table : main_,
                      table != nullptr ? table->root() : nullptr, element.record))
      return false;
    element.bytes -= cursor_.left();
    if (table != nullptr) named_records_.push_back(std::move(element));
  }
  return true;
}

/// Returns nullptr if there are too many names.
ColumnTable* RosTopic::table_of(std::string_view element_name, const std::string& type) {
  const std::string full = name_ + "[" + std::string(element_name.substr(0, 128)) + "]";
  const auto found = named_.find(full);
  if (found != named_.end()) return &found->second;
  if (named_.size() >= kMostNames) return nullptr;
  return &named_.emplace(full, ColumnTable(full, long_type_name(type), budget_)).first->second;
}

bool RosTopic::read_version(std::size_t index, std::string_view message, RosRecord& record) {
  schema_ = &layout_->versions[index];
  named_records_.clear();
  record = {};
  constexpr std::size_t kMostPadding_bytes = 3;
  return cursor_.begin(message) && read_message(0, main_, main_.root(), record) &&
         (layout_->is_beginning || cursor_.left() <= kMostPadding_bytes);
}

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

bool RosTopic::add(double time_s, std::string_view message) {
  RosRecord record;
  bool is_read = read_version(version_, message, record);
  for (std::size_t i = 0; !is_read && i < layout_->versions.size(); ++i) {
    is_read = read_version(i, message, record);
    if (is_read) version_ = i;
  }
  if (!is_read) {
    ++malformed_;
    return false;
  }
  main_.add(time_s, record, message.size());
  for (const NamedRecord& element : named_records_) element.table->add(time_s, element.record, element.bytes);
  return true;
}

void RosTopic::move_to(RawLog& log) {
  main_.move_to(log, !named_.empty());
  for (auto& [name, table] : named_) table.move_to(log, false);
  for (const std::string& array : large_arrays_)
    log.left_out.push_back(
        {name_ + "." + array, fmt::format("it has more than {} elements", kMostElements), 0});
  if (malformed_ > 0) {
    log.health.damaged_blocks += malformed_;
    log.left_out.push_back({name_, "messages do not match the definition of their type", malformed_});
  }
}

void FoundTopic::move_to(RawLog& log, const std::string& id) {
  if (topic)
    topic->move_to(log);
  else
    log.left_out.push_back({name.empty() ? id : name, fault, lost});
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
