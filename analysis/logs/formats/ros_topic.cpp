#include "analysis/logs/formats/ros_topic.h"

#include <fmt/core.h>

#include <limits>
#include <set>

#include "analysis/logs/formats/cdr.h"
#include "analysis/logs/formats/ros_messages.h"

namespace swarmcert::logs {
namespace {

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kMostNames = 1024;
constexpr std::size_t kLongestText_bytes = 4096;

/// Place of a value within messages: a field, or an element of an array. Remembers its column, so that names are made once.
struct RosNode {
  const RosNode* parent = nullptr;
  std::string label;  ///< ".x", "[3]"
  std::optional<std::size_t> column;
  bool is_stamp = false, has_text = false;
  std::vector<std::unique_ptr<RosNode>> children;

  std::string name() const {
    if (parent == nullptr) return "";
    const std::string before = parent->name();
    return before.empty() && !label.empty() && label[0] == '.' ? label.substr(1) : before + label;
  }
};

/// What one message says, before it is known to be sound as a whole.
struct RosRecord {
  std::vector<std::pair<RosNode*, double>> numbers;
  std::vector<std::pair<RosNode*, std::string_view>> texts;
};

/// A RawTopic in the making.
class ColumnTable {
 public:
  ColumnTable(const std::string& name, const std::string& type, RosBudget& budget) : budget_(budget) {
    topic_.name = name;
    topic_.type = type;
  }

  RosNode* root() { return &root_; }

  /// The child of `parent`; nullptr if that is nullptr or there are too many. @param label of an element: its index
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
    for (const auto& [node, value] : record.numbers) {
      if (!node->column) node->column = new_column(*node, row);
      if (*node->column < topic_.columns.size()) topic_.columns[*node->column].values.push_back(value);
    }
    for (RawColumn& column : topic_.columns)
      if (column.values.size() == row) column.values.push_back(kMissing);
    for (const auto& [node, text] : record.texts) {
      if (node->has_text || text.empty()) continue;
      node->has_text = true;
      if (topic_.texts.size() < kMostElements)
        topic_.texts[node->name()] = text.substr(0, kLongestText_bytes);
    }
    limit_values();
  }

  /// @param has_elements some of what the messages say stands in topics of its own: nothing may be left for this one
  void move_to(RawLog& log, bool has_elements) {
    if (!given_up_.empty()) {
      log.skipped.push_back({topic_.name, given_up_, records_});
      return;
    }
    if (has_too_many_columns_)
      log.skipped.push_back(
          {topic_.name, fmt::format("only its first {} numbers are kept", topic_.columns.size()), 0});
    if (topic_.time_s.empty() || (has_elements && topic_.columns.empty())) return;
    log.health.records += topic_.time_s.size();
    log.topics.push_back(std::move(topic_));
  }

 private:
  static constexpr std::size_t kMostPlaces = 4 * kMostColumns;

  /// Its index; beyond the last where there are too many.
  std::size_t new_column(const RosNode& node, std::size_t row) {
    if (topic_.columns.size() >= kMostColumns) {
      has_too_many_columns_ = true;
      return std::numeric_limits<std::size_t>::max();
    }
    topic_.columns.push_back({node.name(), node.is_stamp ? "s" : "", std::vector<double>(row, kMissing)});
    return topic_.columns.size() - 1;
  }

  /// One long message among many short ones would need a value of each column for each of them.
  void limit_values() {
    constexpr std::size_t kMostMissing = std::size_t{1} << 16;
    constexpr std::size_t kMostPerByte = 8;
    const std::size_t values = (topic_.columns.size() + 1) * topic_.time_s.size();
    const std::size_t more = values - values_;
    values_ = values;
    if (values > kMostMissing + kMostPerByte * bytes_)
      given_up_ = "its arrays vary too much in length to be columns";
    if (more > budget_.values) given_up_ = "the log holds more numbers than memory may";
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

/// The text field of `type` that tells its elements apart in an array of them.
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

  /// A record of a topic of its own, for an element of a named array.
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
  // Of the message that is being read.
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

  /// @param node of the array, nullptr if its elements are not wanted
  bool read_array(const RosField& field, ColumnTable& table, RosNode* node, RosRecord& record) {
    std::size_t count = field.count;
    if (field.array == RosArray::kSequence && !cursor.read_count(count)) return false;
    if (count > kMostElements) {
      if (node != nullptr && large_arrays.size() < kMostElements) large_arrays.insert(node->name());
      node = nullptr;
    }
    if (node == nullptr && field.kind == RosKind::kNumber) return cursor.skip(field.number, count);
    // Every element has a byte at least: a count that the message cannot hold ends with the message.
    for (std::size_t i = 0; i < count; ++i)
      if (!read_value(field, table, table.child(node, i, nullptr), record)) return false;
    return true;
  }

  /// @param node of the message, nullptr if it is not wanted
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

  /// nullptr if there are too many names.
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
    log.skipped.push_back(
        {s.name, "messages do not have the form that the definition of their type says", s.malformed});
  }
}

void number_instances(RawLog& log) {
  std::map<std::string, int> counts;
  for (RawTopic& topic : log.topics) topic.instance = counts[topic.name]++;
}

}  // namespace swarmcert::logs
