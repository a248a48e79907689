#include "nn/weights/onnx/model.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <utility>

#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "nn/weights/onnx/protobuf.h"
#include "nn/weights/tensors.h"

namespace swarmcert::files {
namespace {

constexpr std::size_t kMostNodes = 10'000;

std::optional<Precision> onnx_precision(std::uint64_t type) {
  switch (type) {
    case kOnnxFloat:
      return Precision::kFloat32;
    case kOnnxDouble:
      return Precision::kFloat64;
    case kOnnxFloat16:
      return Precision::kFloat16;
    case kOnnxBfloat16:
      return Precision::kBfloat16;
    default:
      return std::nullopt;
  }
}

/// Returns the field of TensorProto that holds numbers of `type` when they are not raw.
std::uint32_t typed_field(std::uint64_t type) {
  switch (type) {
    case kOnnxFloat:
      return 4;
    case kOnnxInt64:
      return 7;
    case kOnnxDouble:
      return 10;
    default:
      return 5;  // int32, bool and both half-precision types
  }
}

class OnnxModelReader {
 public:
  OnnxModelReader(const std::string& bytes, const std::string& path) : bytes_(bytes), path_(path) {}

  OnnxModel run() {
    ProtobufReader model(bytes_, 0, path_);
    bool has_graph = false;
    for (ProtobufField field; model.next(field);) {
      if (field.number == 8) read_operator_set(field);
      if (field.number == 14)
        model_.unused.push_back("metadata_props " + key_value(field).first + ": describes the model");
      if (field.number == 20) model_.unused.push_back("training_info: is for training");
      if (field.number != 7) continue;  // 7: graph; the other fields only say who wrote the file and when
      if (std::exchange(has_graph, true)) refuse(field.offset, "graph", "appears twice");
      read_graph(field);
    }
    if (!has_graph)
      refuse(0, "graph", "is missing, so this is not an ONNX model",
             "convert a TensorFlow SavedModel: python -m tf2onnx.convert --saved-model FOLDER --output "
             "net.onnx");
    choose_input();
    return std::move(model_);
  }

 private:
  [[noreturn]] void refuse(std::size_t offset, const std::string& field, const std::string& what,
                           const std::string& hint = kReexportOnnx) const {
    throw InputError({path_, "offset " + std::to_string(offset), field, "", what, hint});
  }

  ProtobufReader fields(const ProtobufField& message) const {
    if (!message.is_bytes) refuse(message.offset, "", "a message is stored as a number");
    return {message.bytes, static_cast<std::size_t>(message.bytes.data() - bytes_.data()), path_};
  }
  std::string text(const ProtobufField& field) const {
    if (!field.is_bytes) refuse(field.offset, "", "a name is stored as a number");
    return std::string(field.bytes);
  }

  void read_operator_set(const ProtobufField& message) {
    std::string domain;
    std::int64_t version = 0;
    ProtobufReader reader = fields(message);
    for (ProtobufField field; reader.next(field);) {
      if (field.number == 1) domain = text(field);
      if (field.number == 2 && !field.is_bytes) version = static_cast<std::int64_t>(field.value);
    }
    if (domain.empty() || domain == "ai.onnx") model_.operator_set = version;
  }

  void read_graph(const ProtobufField& message) {
    ProtobufReader graph = fields(message);
    for (ProtobufField field; graph.next(field);) {
      if (field.number == 1) model_.nodes.push_back(node(field));
      if (field.number == 5) keep(tensor(field));
      if (field.number == 11) inputs_.push_back(value_info(field));
      if (field.number == 12) {
        const std::string name = value_info(field).name;
        if (!model_.output.empty())
          refuse(field.offset, "graph",
                 "has two outputs, " + in_quotes(model_.output) + " and " + in_quotes(name),
                 "export the model with the output that is to be certified alone");
        model_.output = name;
      }
      if (field.number == 14) refuse(field.offset, "", "quantized tensors cannot be read");
      if (field.number == 15) refuse(field.offset, "", "sparse tensors cannot be read");
      if (model_.nodes.size() > kMostNodes) refuse(field.offset, "", "the graph has more than 10000 nodes");
    }
  }

  void keep(OnnxTensor tensor) {
    const std::string name = tensor.name;
    const std::size_t offset = tensor.offset;
    if (!model_.tensors.emplace(name, std::move(tensor)).second)
      refuse(offset, in_quotes(name), "appears twice");
  }

  /// Finds the graph's only input that is not a stored tensor; old exporters also list stored tensors as inputs.
  void choose_input() {
    int count = 0;
    for (OnnxInput& input : inputs_) {
      if (model_.tensors.count(input.name) == 1) continue;
      model_.input = std::move(input);
      ++count;
    }
    if (count != 1) refuse(0, "graph", "has " + std::to_string(count) + " inputs, not one");
  }

  OnnxInput value_info(const ProtobufField& message) const {
    OnnxInput input;
    ProtobufReader info = fields(message);
    for (ProtobufField field; info.next(field);) {
      if (field.number == 1) input.name = text(field);
      if (field.number == 2) read_type(field, input);
    }
    return input;
  }

  void read_type(const ProtobufField& message, OnnxInput& input) const {
    ProtobufReader type = fields(message);
    for (ProtobufField field; type.next(field);) {
      if (field.number != 1) continue;  // tensor_type
      ProtobufReader tensor_type = fields(field);
      for (ProtobufField part; tensor_type.next(part);) {
        if (part.number != 2) continue;  // shape
        input.shape.emplace();
        ProtobufReader shape = fields(part);
        for (ProtobufField dimension; shape.next(dimension);)
          if (dimension.number == 1) input.shape->push_back(size_of(dimension));
      }
    }
  }

  std::int64_t size_of(const ProtobufField& message) const {
    std::int64_t size = -1;
    ProtobufReader dimension = fields(message);
    for (ProtobufField field; dimension.next(field);)
      if (field.number == 1 && !field.is_bytes && field.value > 0 && field.value <= kMostElements)
        size = static_cast<std::int64_t>(field.value);
    return size;
  }

  OnnxNode node(const ProtobufField& message) {
    OnnxNode node;
    node.offset = message.offset;
    std::string domain;
    ProtobufReader reader = fields(message);
    for (ProtobufField field; reader.next(field);) {
      if (field.number == 1) node.inputs.push_back(text(field));
      if (field.number == 2) node.outputs.push_back(text(field));
      if (field.number == 3) node.name = text(field);
      if (field.number == 4) node.type = text(field);
      if (field.number == 5) read_attribute(field, node);
      if (field.number == 7) domain = text(field);
    }
    if (!domain.empty() && domain != "ai.onnx")
      refuse(node.offset, node.label(),
             "is of the operator set " + in_quotes(domain) + ", which cannot be read",
             "export with the operators of ONNX itself");
    if (node.type == "Constant") state_tensor(node);
    // Dropout and BatchNormalization may have further outputs, unused in inference; TopK also returns indices.
    const bool may_have_more = node.type == "Dropout" || node.type == "BatchNormalization" ||
                               node.type == "TopK" || node.type == "Split";
    if (node.outputs.empty() || (node.outputs.size() > 1 && !may_have_more))
      refuse(node.offset, node.label(), "has not exactly one output");
    return node;
  }

  /// Sets the attribute `value` of a Constant node to its tensor, which one of five attributes states.
  void state_tensor(OnnxNode& node) const {
    if (node.has("value") && node.attributes.at("value").tensor) return;
    OnnxTensor tensor;
    tensor.is_read = true;
    tensor.type = node.has("value_int") || node.has("value_ints") ? kOnnxInt64 : kOnnxFloat;
    if (node.has("value_float")) {
      tensor.numbers = {node.number("value_float", 0)};
    } else if (node.has("value_floats")) {
      tensor.numbers = node.attributes.at("value_floats").floats;
      tensor.shape = {tensor.numbers.size()};
    } else if (node.has("value_int")) {
      const double number = node.number("value_int", 0);
      if (!(std::fabs(number) < 0x1p53)) refuse(node.offset, node.label(), "value_int is out of range");
      tensor.integers = {static_cast<std::int64_t>(number)};
    } else if (node.has("value_ints")) {
      tensor.integers = node.integers("value_ints", {});
      tensor.shape = {tensor.integers.size()};
    } else {
      refuse(node.offset, node.label(), "holds no tensor", kReexportOnnx);
    }
    node.attributes["value"].tensor = std::move(tensor);
  }

  void read_attribute(const ProtobufField& message, OnnxNode& node) {
    std::string name;
    OnnxAttribute attribute;
    ProtobufReader reader = fields(message);
    const auto append_float = [&](std::string_view four_bytes) {
      append_numbers(four_bytes.data(), four_bytes.size() / 4, 1, Precision::kFloat32, attribute.floats);
    };
    for (ProtobufField field; reader.next(field);) {
      if (field.number == 1) name = text(field);
      if (field.number == 2 && field.bytes.size() == 4 && !field.is_bytes) {
        std::vector<double> numbers;
        append_numbers(field.bytes.data(), 1, 1, Precision::kFloat32, numbers);
        attribute.number = numbers.front();
      }
      if (field.number == 3 && !field.is_bytes)
        attribute.number = static_cast<double>(static_cast<std::int64_t>(field.value));
      if (field.number == 4 && field.is_bytes) attribute.text = std::string(field.bytes);
      if (field.number == 5) attribute.tensor = tensor(field);
      if (field.number == 7 && field.bytes.size() % 4 == 0) append_float(field.bytes);
      if (field.number == 8) append_integers(field, path_, attribute.integers);
    }
    node.attributes[name] = std::move(attribute);
  }

  std::pair<std::string, std::string> key_value(const ProtobufField& message) const {
    std::pair<std::string, std::string> entry;
    ProtobufReader reader = fields(message);
    for (ProtobufField field; reader.next(field);) {
      if (field.number == 1) entry.first = text(field);
      if (field.number == 2) entry.second = text(field);
    }
    return entry;
  }

  /// Returns the numbers of a tensor that lie in another file of the same folder.
  std::string_view external_data(const OnnxTensor& tensor, std::map<std::string, std::string>& stated) {
    const auto refuse_data = [&](const std::string& value, const std::string& what) {
      throw InputError({path_, "offset " + std::to_string(tensor.offset), in_quotes(tensor.name), value, what,
                        "save the model in one file: onnx.save(model, path, save_as_external_data=False)"});
    };
    const std::string& name = stated["location"];
    const std::filesystem::path location(name);
    const bool is_inside = !name.empty() && name.find('\0') == std::string::npos && location.is_relative() &&
                           std::find(location.begin(), location.end(), "..") == location.end();
    if (!is_inside) refuse_data(in_quotes(name), "its numbers lie outside the folder of the model");
    auto data = data_.find(name);
    if (data == data_.end()) {
      data = data_.emplace(name, read_file((std::filesystem::path(path_).parent_path() / location).string()))
                 .first;
      model_.data_files.emplace_back(name, sha256(data->second));
    }
    const auto count = [&](const char* key, std::uint64_t otherwise) {
      const std::string& digits = stated[key];
      std::uint64_t value = otherwise;
      const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
      if (!digits.empty() && (error != std::errc() || end != digits.data() + digits.size()))
        refuse_data(in_quotes(digits), std::string(key) + " is not a number");
      return value;
    };
    const std::uint64_t size = data->second.size(), offset = count("offset", 0);
    if (offset > size) refuse_data(std::to_string(offset), "begins beyond the end of " + name);
    const std::uint64_t length = count("length", size - offset);
    if (length > size - offset) refuse_data(std::to_string(length), "reaches beyond the end of " + name);
    return std::string_view(data->second).substr(offset, length);
  }

  OnnxTensor tensor(const ProtobufField& message) {
    OnnxTensor tensor;
    tensor.offset = message.offset;
    std::vector<std::int64_t> dims;
    std::map<std::uint32_t, ProtobufField> data;  // keyed by field number of TensorProto
    std::map<std::string, std::string> external;
    bool is_external = false;
    ProtobufReader reader = fields(message);
    for (ProtobufField field; reader.next(field);) {
      if (field.number == 1) append_integers(field, path_, dims);
      if (field.number == 2) tensor.type = field.value;
      if (field.number == 8) tensor.name = text(field);
      const bool holds_numbers = field.number == 4 || field.number == 5 || field.number == 7 ||
                                 field.number == 9 || field.number == 10;
      if (holds_numbers && (!field.is_bytes || !data.emplace(field.number, field).second))
        refuse(field.offset, in_quotes(tensor.name), "its numbers are not in one piece");
      if (field.number == 13) external.insert(key_value(field));
      if (field.number == 14) is_external = field.value != 0;
    }
    if (is_external) {
      ProtobufField raw;
      raw.number = 9;
      raw.is_bytes = true;
      raw.bytes = external_data(tensor, external);
      data.emplace(9, raw);
    }
    for (const std::int64_t size : dims) {
      if (size < 0) refuse(tensor.offset, in_quotes(tensor.name), "has a negative dimension");
      tensor.shape.push_back(static_cast<std::uint64_t>(size));
    }
    read_numbers(data, tensor);
    return tensor;
  }

  /// Rejects data that do not match the shape. A tensor of an unsupported type is rejected when a node uses it.
  void read_numbers(const std::map<std::uint32_t, ProtobufField>& data, OnnxTensor& tensor) const {
    const std::optional<Precision> precision = onnx_precision(tensor.type);
    const bool is_bool = tensor.type == kOnnxBool;
    const bool is_integer = tensor.type == kOnnxInt64 || tensor.type == kOnnxInt32 || is_bool;
    if (!precision && !is_integer) return;
    const std::size_t bytes_each = precision                   ? width(*precision)
                                   : is_bool                   ? 1
                                   : tensor.type == kOnnxInt64 ? 8
                                                               : 4;
    const std::optional<std::uint64_t> count = element_count(tensor.shape);
    const auto raw = data.find(9), typed = data.find(typed_field(tensor.type));
    const bool is_varint = typed != data.end() && raw == data.end() && typed_field(tensor.type) != 4 &&
                           typed_field(tensor.type) != 10;
    std::string_view bytes;
    if (raw != data.end()) bytes = raw->second.bytes;
    if (raw == data.end() && typed != data.end()) bytes = typed->second.bytes;
    std::vector<std::int64_t> integers;
    if (is_varint) append_integers(typed->second, path_, integers);
    const std::size_t found = is_varint ? integers.size() : bytes.size() / bytes_each;
    if (data.size() > 1 || !count || found != *count || (!is_varint && bytes.size() % bytes_each != 0))
      refuse(tensor.offset, in_quotes(tensor.name),
             "holds " + std::to_string(bytes.size()) + " bytes of numbers for the shape " +
                 shape_text(tensor.shape));
    tensor.is_read = true;
    if (is_varint && precision) {
      for (const std::int64_t bits : integers) {
        const auto half = static_cast<std::uint16_t>(bits);
        tensor.numbers.push_back(*precision == Precision::kFloat16 ? from_float16(half)
                                                                   : from_bfloat16(half));
      }
    } else if (precision) {
      append_numbers(bytes.data(), *count, 1, *precision, tensor.numbers);
    } else if (is_varint) {
      tensor.integers = std::move(integers);
    } else {
      for (std::size_t i = 0; i < found; ++i) {
        std::uint64_t bits = 0;
        for (std::size_t k = bytes_each; k-- > 0;)
          bits = bits << 8 | static_cast<unsigned char>(bytes[i * bytes_each + k]);
        tensor.integers.push_back(bytes_each == 4 ? static_cast<std::int32_t>(bits)
                                                  : static_cast<std::int64_t>(bits));
      }
    }
  }

  const std::string& bytes_;
  const std::string& path_;
  OnnxModel model_;
  std::vector<OnnxInput> inputs_;
  std::map<std::string, std::string> data_;  ///< contents of other files
};

}  // namespace

std::string OnnxNode::label() const { return type + (name.empty() ? "" : " " + in_quotes(name)); }

std::string OnnxNode::unread_attribute() const {
  static const std::set<std::pair<std::string, std::string>> kHarmless = {
      {"Dropout", "ratio"},
      {"Dropout", "seed"},
      {"BatchNormalization", "momentum"},
      {"MaxPool", "storage_order"},
      {"Softmax", "axis"},
      {"LogSoftmax", "axis"},
      // before operator set 7, where it matters: require_trailing_axes()
      {"Add", "axis"},
      {"Sub", "axis"},
      {"Mul", "axis"},
      {"Div", "axis"},
      {"PRelu", "axis"}};
  static const std::set<std::string> kOfOldSets = {"consumed_inputs", "broadcast"};
  for (const auto& [attribute, value] : attributes)
    if (read.count(attribute) == 0 && kHarmless.count({type, attribute}) == 0 &&
        kOfOldSets.count(attribute) == 0)
      return attribute;
  return {};
}

double OnnxNode::number(const std::string& attribute, double otherwise) const {
  read.insert(attribute);
  const auto found = attributes.find(attribute);
  return found == attributes.end() ? otherwise : found->second.number.value_or(otherwise);
}

std::vector<std::int64_t> OnnxNode::integers(const std::string& attribute,
                                             const std::vector<std::int64_t>& otherwise) const {
  read.insert(attribute);
  const auto found = attributes.find(attribute);
  return found == attributes.end() ? otherwise : found->second.integers;
}

std::string OnnxNode::text(const std::string& attribute, const std::string& otherwise) const {
  read.insert(attribute);
  const auto found = attributes.find(attribute);
  return found == attributes.end() ? otherwise : found->second.text.value_or(otherwise);
}

OnnxModel read_onnx_model(const std::string& bytes, const std::string& path) {
  return OnnxModelReader(bytes, path).run();
}

}  // namespace swarmcert::files
