#include "nn/base/record.h"

#include <cmath>
#include <mutex>
#include <set>
#include <stdexcept>

#include "nn/base/json.h"

namespace swarmcert::files {
namespace {

/// A scalar as JSON; null if there is none, or if it is a number that is not finite.
Json scalar_json(const Node& node) {
  return std::visit(
      [](const auto& held) -> Json {
        using Held = std::decay_t<decltype(held)>;
        if constexpr (std::is_same_v<Held, std::monostate>)
          return nullptr;
        else if constexpr (std::is_same_v<Held, double>)
          return std::isfinite(held) ? Json(held) : Json();
        else
          return held;
      },
      node.value);
}

const char* type_name(Node::Kind kind) {
  switch (kind) {
    case Node::Kind::kFlag:
      return "boolean";
    case Node::Kind::kInteger:
      return "integer";
    case Node::Kind::kNumber:
      return "number";
    case Node::Kind::kText:
      return "string";
    case Node::Kind::kList:
      return "array";
    default:
      return "object";
  }
}

/// Writes the subschemas of one schema.
class SchemaWriter {
 public:
  explicit SchemaWriter(bool numbers_may_be_null) : numbers_may_be_null_(numbers_may_be_null) {}

  Json of(const Node& shape) const {
    Json schema = Json::object();
    if (*shape.about.meaning != '\0') schema["description"] = shape.about.meaning;
    if (*shape.about.unit != '\0') schema["unit"] = shape.about.unit;
    if (*shape.about.guarantee != '\0') schema["guarantee"] = shape.about.guarantee;
    if (shape.kind == Node::Kind::kAny) return schema;
    if (shape.kind == Node::Kind::kOneOf) {
      for (const Node& alternative : shape.members) schema["anyOf"].push_back(of(alternative));
      return schema;
    }
    add_type(shape, schema);
    if (shape.kind == Node::Kind::kFields) add_fields(shape, schema);
    if (shape.kind == Node::Kind::kMap) schema["additionalProperties"] = of(shape.members.at(0));
    if (shape.kind == Node::Kind::kList) schema["items"] = of(shape.members.at(0));
    if (shape.size > 0) schema["minItems"] = schema["maxItems"] = shape.size;
    return schema;
  }

 private:
  void add_type(const Node& shape, Json& schema) const {
    const bool may_be_null = shape.may_be_null || (numbers_may_be_null_ && shape.kind == Node::Kind::kNumber);
    if (shape.choices.size() == 1 && !may_be_null) {
      schema["const"] = shape.choices[0];
      return;
    }
    if (!shape.choices.empty()) {
      schema["enum"] = shape.choices;
      if (may_be_null) schema["enum"].push_back(nullptr);
      return;
    }
    const char* const type = type_name(shape.kind);
    schema["type"] = may_be_null ? Json({type, "null"}) : Json(type);
  }

  void add_fields(const Node& shape, Json& schema) const {
    schema["properties"] = Json::object();
    Json required = Json::array();
    for (const Node& field : shape.members) {
      schema["properties"][field.name] = of(field);
      if (!field.may_be_absent) required.push_back(field.name);
    }
    schema["required"] = std::move(required);
    schema["additionalProperties"] = false;
  }

  bool numbers_may_be_null_;
};

}  // namespace

const char* interned(const std::string& text) {
  static std::mutex mutex;
  static std::set<std::string> texts;  // elements of a set never move
  const std::lock_guard<std::mutex> lock(mutex);
  return texts.insert(text).first->c_str();
}

const Node* Node::find(std::string_view path) const {
  const std::size_t dot = path.find('.');
  const std::string_view first = path.substr(0, dot);
  for (const Node& member : members) {
    if (member.name == first) return dot == path.npos ? &member : member.find(path.substr(dot + 1));
  }
  return nullptr;
}

void Record::object(const char* name, const char* meaning,
                    const std::function<void(Record&)>& describe_fields) {
  Record inner = add(name, {meaning, "", ""});
  inner.begin(Node::Kind::kFields);
  describe_fields(inner);
}

void Record::may_object(bool is_present, const char* name, const char* meaning,
                        const std::function<void(Record&)>& describe_fields) {
  if (!is_present && !is_shape_) return;
  object(name, meaning, describe_fields);
  node_->members.back().may_be_absent = true;
}

void Record::may_fields(bool is_present, const std::function<void(Record&)>& describe_fields) {
  if (!is_present && !is_shape_) return;
  const std::size_t before = node_->members.size();
  describe_fields(*this);
  for (std::size_t i = before; i < node_->members.size(); ++i) node_->members[i].may_be_absent = true;
}

void Record::object_or_null(bool is_present, const char* name, const char* meaning,
                            const std::function<void(Record&)>& describe_fields) {
  if (is_present || is_shape_)
    object(name, meaning, describe_fields);
  else
    add(name, {meaning, "", ""});
  node_->members.back().may_be_null = true;
}

void Record::constant(const char* name, const std::string& text, const char* meaning) {
  add(name, {meaning, "", ""}).choose(0, {text});
}

void Record::put(const nlohmann::ordered_json& json) {
  node_->kind = Node::Kind::kAny;
  if (is_shape_) return;
  if (json.is_boolean()) return put_flag(json.get<bool>());
  if (json.is_number_unsigned()) return put_unsigned(json.get<std::uint64_t>());
  if (json.is_number_integer()) return put_integer(json.get<std::int64_t>());
  if (json.is_number()) return put_number(json.get<double>());
  if (json.is_string()) return put_text(json.get_ref<const std::string&>());
  if (json.is_array()) begin(Node::Kind::kList);
  if (json.is_object()) begin(Node::Kind::kMap);
  for (const auto& [key, member] : json.items()) (json.is_array() ? element() : entry(key)).put(member);
}

void Record::put(const Node& node) {
  const std::string name = node_->name;
  const About about = node_->about;
  const bool may_be_absent = node_->may_be_absent;
  *node_ = node;
  node_->name = name;
  node_->about = about;
  node_->may_be_absent = may_be_absent;
}

Record Record::add(const char* name, const About& about) {
  for (const Node& member : node_->members) {
    if (member.name == name) throw std::logic_error(std::string("field described twice: ") + name);
  }
  begin(Node::Kind::kFields);
  Record inner = entry(name);
  inner.node_->about = about;
  return inner;
}

Record Record::element() {
  node_->members.emplace_back();
  return {node_->members.back(), is_shape_};
}

Record Record::entry(const std::string& key) {
  Record inner = element();
  inner.node_->name = key;
  return inner;
}

void Record::put_flag(bool value) {
  begin(Node::Kind::kFlag);
  node_->value = value;
}

void Record::put_integer(std::int64_t value) {
  begin(Node::Kind::kInteger);
  node_->value = value;
}

void Record::put_unsigned(std::uint64_t value) {
  begin(Node::Kind::kInteger);
  node_->value = value;
}

void Record::put_number(double value) {
  begin(Node::Kind::kNumber);
  node_->value = value;
}

void Record::put_text(std::string_view value) {
  begin(Node::Kind::kText);
  node_->value = std::string(value);
}

void Record::choose(std::size_t index, std::vector<std::string> names) {
  begin(Node::Kind::kText);
  node_->value = names.at(index);
  if (is_shape_) node_->choices = std::move(names);
}

std::vector<std::string> field_names(const Node& shape) {
  std::vector<std::string> names;
  for (const Node& field : shape.members) names.push_back(field.name);
  return names;
}

Json to_json(const Node& value) {
  switch (value.kind) {
    case Node::Kind::kFields:
    case Node::Kind::kMap: {
      Json object = Json::object();
      for (const Node& member : value.members) object[member.name] = to_json(member);
      return object;
    }
    case Node::Kind::kList: {
      Json array = Json::array();
      for (const Node& member : value.members) array.push_back(to_json(member));
      return array;
    }
    default:
      return scalar_json(value);
  }
}

Json schema_of(const Node& shape, const std::string& name, const std::string& title,
               const std::string& description, bool numbers_may_be_null) {
  Json schema = {{"$schema", "https://json-schema.org/draft/2020-12/schema"},
                 {"$id", "urn:swarmcert:schema:" + name + ":1"},
                 {"title", title},
                 {"description", description}};
  schema.update(SchemaWriter(numbers_may_be_null).of(shape));
  return schema;
}

void describe(Record& record, const Axes& axes) {
  record.field("x", axes.x, "");
  record.field("y", axes.y, "");
  record.field("z", axes.z, "");
}

void describe(Record& record, const AxesAndTotal& axes) {
  record.field("x", axes.x, "");
  record.field("y", axes.y, "");
  record.field("z", axes.z, "");
  record.field("total", axes.total, "");
}

}  // namespace swarmcert::files
