#include "nn/weights/onnx.h"

#include <map>
#include <optional>
#include <set>
#include <utility>

#include "nn/base/input_error.h"
#include "nn/weights/protobuf.h"
#include "nn/weights/tensors.h"

namespace swarmcert::files {
namespace {

constexpr std::size_t kMostNodes = 10'000;
constexpr char kReexport[] =
    "export a plain chain of linear layers with ReLU between them: torch.onnx.export(model, ...)";

/// TensorProto.data_type of the types that we take; the others have names for the message.
constexpr std::uint64_t kFloat = 1;
constexpr std::uint64_t kDouble = 11;

/// A tensor that lies in the file.
struct Stored {
  std::string name;
  std::vector<std::uint64_t> shape;
  std::uint64_t type = 0;
  std::string_view raw;  ///< its numbers, little-endian
  std::size_t offset = 0;
};

struct Attribute {
  std::optional<double> number;  ///< of a float or an integer
  std::optional<Stored> tensor;
};

struct Node {
  std::string type, name;
  std::vector<std::string> inputs, outputs;
  std::map<std::string, Attribute> attributes;
  std::size_t offset = 0;

  std::string label() const { return type + (name.empty() ? "" : " " + in_quotes(name)); }
};

/// One affine layer, by what is stored of it.
struct Affine {
  Stored weight;
  bool is_transposed = false;  ///< stored as [inputs x outputs]
  std::optional<Stored> bias;
  std::size_t node_offset = 0;
};

class OnnxReader {
 public:
  OnnxReader(const std::string& bytes, const std::string& path, const std::vector<std::string>& order)
      : bytes_(bytes), path_(path), order_(order) {}

  Weights run() {
    read_model();
    std::string current = input();
    for (const Node& node : nodes_) current = follow(node, current);
    if (output_ != current)
      refuse(0, in_quotes(output_), "the graph's output is not where its chain of nodes ends");
    if (layers_.empty()) refuse(0, "", "the graph has no linear layer");
    if (after_relu_)
      refuse(0, "", "the network ends in a Relu", "leave the last activation out: it is no part of an MLP");
    return assembled();
  }

 private:
  [[noreturn]] void refuse(std::size_t offset, const std::string& field, const std::string& what,
                           const std::string& mend = kReexport) const {
    throw InputError({path_, "offset " + std::to_string(offset), field, "", what, mend});
  }

  ProtobufReader fields(const ProtobufField& message) const {
    if (!message.is_bytes) refuse(message.offset, "", "a message is stored as a number");
    return {message.bytes, offset_of(message.bytes), path_};
  }
  std::size_t offset_of(std::string_view part) const {
    return static_cast<std::size_t>(part.data() - bytes_.data());
  }
  std::string text(const ProtobufField& field) const {
    if (!field.is_bytes) refuse(field.offset, "", "a name is stored as a number");
    return std::string(field.bytes);
  }

  void read_model() {
    ProtobufReader model(bytes_, 0, path_);
    bool has_graph = false;
    for (ProtobufField field; model.next(field);) {
      if (field.number != 7) continue;  // 7: graph; the rest says who wrote it and when
      if (std::exchange(has_graph, true)) refuse(field.offset, "graph", "appears twice");
      read_graph(field);
    }
    if (!has_graph) refuse(0, "graph", "is missing");
  }

  void read_graph(const ProtobufField& message) {
    ProtobufReader graph = fields(message);
    for (ProtobufField field; graph.next(field);) {
      if (field.number == 1) nodes_.push_back(node(field));
      if (field.number == 5) keep(tensor(field));
      if (field.number == 11) inputs_.push_back(name_of(field));
      if (field.number == 12) {
        if (!output_.empty()) refuse(field.offset, "", "the graph has more than one output");
        output_ = name_of(field);
      }
      if (field.number == 15) refuse(field.offset, "", "sparse tensors cannot be read");
      if (nodes_.size() > kMostNodes) refuse(field.offset, "", "the graph has more than 10000 nodes");
    }
  }

  std::string name_of(const ProtobufField& value_info) const {
    ProtobufReader info = fields(value_info);
    std::string name;
    for (ProtobufField field; info.next(field);)
      if (field.number == 1) name = text(field);
    return name;
  }

  Node node(const ProtobufField& message) const {
    Node node;
    node.offset = message.offset;
    ProtobufReader reader = fields(message);
    for (ProtobufField field; reader.next(field);) {
      if (field.number == 1) node.inputs.push_back(text(field));
      if (field.number == 2) node.outputs.push_back(text(field));
      if (field.number == 3) node.name = text(field);
      if (field.number == 4) node.type = text(field);
      if (field.number == 5) read_attribute(field, node);
      if (field.number == 7 && !text(field).empty() && text(field) != "ai.onnx")
        refuse(field.offset, in_quotes(text(field)), "the node is of an operator set that cannot be read");
    }
    if (node.outputs.size() != 1) refuse(node.offset, node.label(), "has not exactly one output");
    return node;
  }

  void read_attribute(const ProtobufField& message, Node& node) const {
    std::string name;
    Attribute attribute;
    ProtobufReader reader = fields(message);
    for (ProtobufField field; reader.next(field);) {
      if (field.number == 1) name = text(field);
      if (field.number == 2 && field.bytes.size() == 4 && !field.is_bytes) {
        std::vector<double> numbers;
        append_numbers(field.bytes.data(), 1, 1, Precision::kFloat32, numbers);
        attribute.number = numbers.front();
      }
      if (field.number == 3 && !field.is_bytes)
        attribute.number = static_cast<double>(static_cast<std::int64_t>(field.value));
      if (field.number == 5) attribute.tensor = tensor(field);
    }
    node.attributes[name] = std::move(attribute);
  }

  Stored tensor(const ProtobufField& message) const {
    Stored tensor;
    tensor.offset = message.offset;
    std::vector<std::int64_t> dims;
    std::map<std::uint32_t, std::string_view> data;  // by field: float_data, double_data, raw_data
    ProtobufReader reader = fields(message);
    for (ProtobufField field; reader.next(field);) {
      if (field.number == 1) append_integers(field, path_, dims);
      if (field.number == 2) tensor.type = field.value;
      if (field.number == 8) tensor.name = text(field);
      if (field.number == 4 || field.number == 9 || field.number == 10) {
        if (!field.is_bytes || !data.emplace(field.number, field.bytes).second)
          refuse(field.offset, in_quotes(tensor.name), "its numbers are not in one piece");
      }
      if (field.number == 13 || (field.number == 14 && field.value != 0))
        refuse(field.offset, in_quotes(tensor.name), "its numbers lie in another file",
               "save the model in one file: onnx.save(model, path, save_as_external_data=False)");
    }
    for (const std::int64_t size : dims) {
      if (size < 0) refuse(tensor.offset, in_quotes(tensor.name), "has a dimension below 0");
      tensor.shape.push_back(static_cast<std::uint64_t>(size));
    }
    if (tensor.type != kFloat && tensor.type != kDouble) return tensor;  // refused where a layer uses it
    const std::uint32_t typed = tensor.type == kFloat ? 4 : 10;
    const std::size_t bytes_each = tensor.type == kFloat ? 4 : 8;
    for (const auto& [field, numbers] : data) {
      if (field == 9 || field == typed) tensor.raw = numbers;
    }
    const std::optional<std::uint64_t> count = element_count(tensor.shape);
    if (data.size() > 1 || !count || tensor.raw.size() / bytes_each != *count ||
        tensor.raw.size() % bytes_each != 0)
      refuse(tensor.offset, in_quotes(tensor.name),
             "holds " + std::to_string(tensor.raw.size()) + " bytes of numbers for the shape " +
                 shape_text(tensor.shape));
    return tensor;
  }

  void keep(Stored tensor) {
    const std::string name = tensor.name;
    const std::size_t offset = tensor.offset;
    if (!stored_.emplace(name, std::move(tensor)).second) refuse(offset, in_quotes(name), "appears twice");
  }

  /// The graph's one input that is not a stored tensor: old exporters list those as inputs too.
  std::string input() const {
    std::string found;
    int count = 0;
    for (const std::string& name : inputs_) {
      if (stored_.count(name) == 1) continue;
      found = name;
      ++count;
    }
    if (count != 1) refuse(0, "graph", "has " + std::to_string(count) + " inputs, not one");
    return found;
  }

  const Stored& stored(const Node& node, const std::string& name) const {
    const auto found = stored_.find(name);
    if (found == stored_.end()) refuse(node.offset, node.label(), "lacks its weights or biases");
    return found->second;
  }

  /// What `node` makes of the chain's `current` value: the name of the next one.
  std::string follow(const Node& node, const std::string& current) {
    const auto is_stored = [this](const std::string& name) { return stored_.count(name) == 1; };
    const std::size_t count = node.inputs.size();
    if (node.type == "Constant" && count == 0) {
      const auto value = node.attributes.find("value");
      if (value == node.attributes.end() || !value->second.tensor)
        refuse(node.offset, node.label(), "holds no tensor");
      Stored tensor = *value->second.tensor;
      tensor.name = node.outputs[0];
      keep(std::move(tensor));
      return current;
    }
    if (node.type == "Identity" && count == 1 && is_stored(node.inputs[0])) {
      Stored tensor = stored_.at(node.inputs[0]);
      tensor.name = node.outputs[0];
      keep(std::move(tensor));
      return current;
    }
    bool is_chained = false;
    for (const std::string& name : node.inputs) {
      if (name == current && std::exchange(is_chained, true))
        refuse(node.offset, node.label(), "uses its input twice");
      if (name != current && !name.empty() && !is_stored(name))
        refuse(node.offset, node.label(),
               "takes " + in_quotes(name) + ", which is neither the value before it nor stored");
    }
    if (!is_chained)
      refuse(node.offset, node.label(), "does not take the value that the node before it gives");
    if (node.type == "Gemm") {
      read_gemm(node, current);
    } else if (node.type == "MatMul" && count == 2 && node.inputs[0] == current) {
      start_layer({stored(node, node.inputs[1]), true, std::nullopt, node.offset}, node);
    } else if (node.type == "Add" && count == 2) {
      add_bias(node, stored(node, node.inputs[node.inputs[0] == current ? 1 : 0]));
    } else if (node.type == "Relu" && count == 1) {
      if (layers_.empty() || after_relu_) refuse(node.offset, node.label(), "does not follow a linear layer");
      after_relu_ = true;
    } else if (node.type != "Identity" || count != 1) {
      refuse(node.offset, node.label(),
             "is not Gemm, MatMul of the input with weights, Add, Relu or Identity");
    }
    return node.outputs[0];
  }

  void read_gemm(const Node& node, const std::string& current) {
    const auto attribute = [&node](const char* name, double otherwise) {
      const auto found = node.attributes.find(name);
      return found == node.attributes.end() ? otherwise : found->second.number.value_or(-1);
    };
    if (node.inputs.size() < 2 || node.inputs.size() > 3 || node.inputs[0] != current ||
        node.inputs[1].empty())
      refuse(node.offset, node.label(), "is not the input times weights plus biases");
    for (const char* const factor : {"alpha", "beta"}) {
      if (attribute(factor, 1) != 1) refuse(node.offset, node.label(), std::string(factor) + " is not 1");
    }
    if (attribute("transA", 0) != 0) refuse(node.offset, node.label(), "transposes its input");
    Affine layer{stored(node, node.inputs[1]), attribute("transB", 0) == 0, std::nullopt, node.offset};
    start_layer(std::move(layer), node);
    if (node.inputs.size() == 3 && !node.inputs[2].empty()) add_bias(node, stored(node, node.inputs[2]));
  }

  void start_layer(Affine layer, const Node& node) {
    if (!layers_.empty() && !after_relu_)
      refuse(node.offset, node.label(), "two linear layers without a Relu between them");
    after_relu_ = false;
    layers_.push_back(std::move(layer));
  }

  void add_bias(const Node& node, const Stored& bias) {
    if (layers_.empty() || after_relu_ || layers_.back().bias)
      refuse(node.offset, node.label(), "adds where no layer takes a bias");
    Stored flat = bias;
    if (flat.shape.size() == 2 && flat.shape[0] == 1) flat.shape.erase(flat.shape.begin());
    layers_.back().bias = std::move(flat);
  }

  /// "fc1" from "fc1.weight"; a layer whose name is taken, or empty, is numbered.
  std::string layer_name(const std::string& weight, std::size_t k) {
    constexpr std::string_view kSuffix = ".weight";
    std::string name = weight;
    if (name.size() > kSuffix.size() &&
        name.compare(name.size() - kSuffix.size(), kSuffix.size(), kSuffix) == 0)
      name.resize(name.size() - kSuffix.size());
    while (name.empty() || !names_.insert(name).second)
      name = "layer" + std::to_string(k + 1) + (name.empty() ? "" : "_" + name);
    return name;
  }

  Weights assembled() {
    std::vector<DeclaredTensor> declared;
    std::vector<std::pair<const Stored*, bool>> sources;
    const auto declare = [&](const std::string& name, const Stored& stored, bool is_transposed) {
      DeclaredTensor tensor{name, std::nullopt, "data type " + std::to_string(stored.type), stored.shape};
      if (stored.type == kFloat) tensor.precision = Precision::kFloat32;
      if (stored.type == kDouble) tensor.precision = Precision::kFloat64;
      if (is_transposed && tensor.shape.size() == 2) std::swap(tensor.shape[0], tensor.shape[1]);
      declared.push_back(std::move(tensor));
      sources.emplace_back(&stored, is_transposed);
    };
    for (std::size_t k = 0; k < layers_.size(); ++k) {
      const std::string name = layer_name(layers_[k].weight.name, k);
      declare(name + ".weight", layers_[k].weight, layers_[k].is_transposed);
      if (layers_[k].bias) declare(name + ".bias", *layers_[k].bias, false);
    }
    const TensorReader read = [&](std::size_t i) {
      const auto& [stored, is_transposed] = sources[i];
      const Precision precision = *declared[i].precision;
      const std::uint64_t count = *element_count(stored->shape);
      std::vector<double> numbers;
      if (!is_transposed) {
        append_numbers(stored->raw.data(), count, 1, precision, numbers);
        return numbers;
      }
      const std::uint64_t outputs = stored->shape[1];
      for (std::uint64_t i_out = 0; i_out < outputs; ++i_out)
        append_numbers(stored->raw.data() + i_out * width(precision), stored->shape[0], outputs, precision,
                       numbers);
      return numbers;
    };
    return assemble(declared, read, path_, Listing::kEvaluation, order_);
  }

  const std::string& bytes_;
  const std::string& path_;
  const std::vector<std::string>& order_;
  std::vector<Node> nodes_;
  std::map<std::string, Stored> stored_;
  std::vector<std::string> inputs_;
  std::string output_;
  std::vector<Affine> layers_;
  bool after_relu_ = false;
  std::set<std::string> names_;
};

}  // namespace

bool looks_like_onnx(const std::string& bytes) {
  // Field 1 (the IR version, a small varint), then the tag of another field of a model: producer, graph, opset.
  if (bytes.size() < 3 || bytes[0] != '\x08' || bytes[1] < 1 || bytes[1] > 31) return false;
  const std::string tags = "\x12\x1a\x22\x28\x32\x3a\x42";
  return tags.find(bytes[2]) != std::string::npos;
}

Weights parse_onnx(const std::string& bytes, const std::string& path, const std::vector<std::string>& order) {
  return OnnxReader(bytes, path, order).run();
}

}  // namespace swarmcert::files
