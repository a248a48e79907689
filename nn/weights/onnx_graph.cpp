#include "nn/weights/onnx_graph.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "nn/base/input_error.h"
#include "nn/weights/tensors.h"

namespace swarmcert::files {
namespace {

constexpr char kOperators[] =
    "is none of the operators that can be read: Gemm, MatMul, Conv, BatchNormalization, AveragePool, "
    "MaxPool, "
    "Add, Sub, Mul, Div, Relu, LeakyRelu, PRelu, Clip, HardSigmoid, Abs, Max, Min, Tanh, Sigmoid, Softplus, "
    "Elu, Gelu, Flatten, Reshape, "
    "Transpose, "
    "Concat and the like";
constexpr char kSmooth[] =
    "leave it out of the exported model where it is the last node; a network with it between its layers "
    "cannot "
    "be read: train with ReLU, LeakyReLU, Hardtanh, tanh, sigmoid, softplus, ELU, SELU, SiLU or GELU";

bool is_unread_activation(const std::string& type) {
  static const std::set<std::string> kTypes = {"Erf", "Exp", "Mish", "HardSwish", "Softsign"};
  return kTypes.count(type) == 1;
}

std::size_t inputs_that_count(const OnnxNode& node) {
  return node.type == "BatchNormalization" || node.type == "Dropout" ? 1 : node.inputs.size();
}

}  // namespace

OnnxGraph::OnnxGraph(OnnxModel model, const std::string& path)
    : model_(std::move(model)), path_(path), chain_(0) {}

void OnnxGraph::refuse(std::size_t offset, const std::string& field, const std::string& what,
                       const std::string& mend) const {
  throw InputError({path_, "offset " + std::to_string(offset), field, "", what, mend});
}

Weights OnnxGraph::run() {
  const OnnxShape shape = input_shape();
  const auto count = element_count({shape.begin(), shape.end()});
  if (!count || *count > kMostRows) refuse(0, in_quotes(model_.input.name), "has more than 2^20 entries");
  chain_ = ReluChain(static_cast<int>(*count));
  values_[model_.input.name] = {identity_map(static_cast<int>(*count)), shape, ""};
  join_smooth_activations();
  count_uses();
  for (const Node& node : model_.nodes) follow(node);
  const auto output = values_.find(model_.output);
  if (output == values_.end())
    refuse(0, in_quotes(model_.output), "the graph's output is not where its chain of nodes ends");
  OnnxValue& last = output->second;
  if (!chain_.has_layers() && last.map.is_identity()) refuse(0, "", "the graph has no linear layer");
  if (chain_.has_layers() && last.map.is_identity())
    notes_.insert(std::string("the network ends in a ") + function_of(activation_).words +
                  ", which an identity layer follows");
  Weights weights;
  weights.activation = activation_;
  try {
    weights.layers = chain_.finished(last.map, layer_name(last.name));
  } catch (const FoldingLimit& limit) {
    refuse(0, in_quotes(model_.output), limit.what, "certify a smaller network");
  }
  bool is_double = false;
  for (const auto& [name, tensor] : model_.tensors) is_double = is_double || tensor.type == kOnnxDouble;
  weights.precision = is_double ? Precision::kFloat64 : least_precision(weights.layers);
  weights.notes.assign(notes_.begin(), notes_.end());
  return weights;
}

OnnxShape OnnxGraph::input_shape() const {
  std::vector<std::int64_t> stated = model_.input.shape.value_or(std::vector<std::int64_t>{1, -1});
  if (stated.empty()) stated = {-1};
  if (stated.size() > 8) refuse(0, in_quotes(model_.input.name), "has more than 8 dimensions");
  if (stated.size() > 1 && stated[0] == -1) stated[0] = 1;
  const auto open = std::count(stated.begin(), stated.end(), -1);
  if (open > 1)
    refuse(0, in_quotes(model_.input.name), "its shape leaves open more than the size of the batch",
           "export with inputs of a fixed size");
  if (open == 0) return stated;
  const std::int64_t inputs = inputs_by_first_node();
  std::int64_t known = 1;
  for (const std::int64_t size : stated)
    known *= size == -1 ? 1 : std::min<std::int64_t>(size, kMostElements);
  if (known > static_cast<std::int64_t>(kMostElements) || inputs % known != 0)
    refuse(0, in_quotes(model_.input.name), "its shape does not fit the first node");
  std::replace(stated.begin(), stated.end(), std::int64_t{-1}, inputs / known);
  return stated;
}

/// A stored tensor, also one that a Constant node holds or an Identity node hands on; null: none.
const OnnxTensor* OnnxGraph::stored_anywhere(const std::string& name) const {
  const auto stored = model_.tensors.find(name);
  if (stored != model_.tensors.end()) return &stored->second;
  std::string wanted = name;
  for (auto node = model_.nodes.rbegin(); node != model_.nodes.rend(); ++node) {
    if (node->outputs[0] != wanted) continue;
    if (node->type == "Constant" && node->has("value") && node->attributes.at("value").tensor)
      return &*node->attributes.at("value").tensor;
    if (node->type != "Identity" || node->inputs.size() != 1) return nullptr;
    wanted = node->inputs[0];
    const auto found = model_.tensors.find(wanted);
    if (found != model_.tensors.end()) return &found->second;
  }
  return nullptr;
}

/// Where the file does not state the size of the input: what the first node with weights takes.
std::int64_t OnnxGraph::inputs_by_first_node() const {
  std::string current = model_.input.name;
  for (const Node& node : model_.nodes) {
    const auto found = std::find(node.inputs.begin(), node.inputs.end(), current);
    if (found == node.inputs.end() || node.outputs.empty()) continue;
    const OnnxTensor* const weight =
        node.inputs.size() < 2 ? nullptr : stored_anywhere(node.inputs[found == node.inputs.begin() ? 1 : 0]);
    if (weight != nullptr) {
      const std::vector<std::uint64_t>& shape = weight->shape;
      const bool is_matrix = shape.size() == 2;
      const bool outputs_first =
          node.type == "Gemm" ? node.number("transB", 0) != 0 : found != node.inputs.begin();
      if (is_matrix && (node.type == "Gemm" || node.type == "MatMul") && shape[outputs_first ? 1 : 0] > 0)
        return static_cast<std::int64_t>(shape[outputs_first ? 1 : 0]);
    }
    current = node.outputs[0];
  }
  refuse(0, in_quotes(model_.input.name), "the model does not state its size",
         "export with an example input, so that the model states its shape");
}

void OnnxGraph::count_uses() {
  for (const Node& node : model_.nodes)
    for (std::size_t k = 0; k < inputs_that_count(node); ++k) ++uses_[node.inputs[k]];
  ++uses_[model_.output];
}

void OnnxGraph::follow(const Node& node) {
  try {
    if (follow_constant(node)) return;
    OnnxValue result = computed(node);
    require_finite(node, result.map);
    for (std::size_t k = 0; k < inputs_that_count(node); ++k) {
      const std::string& name = node.inputs[k];
      if (--uses_[name] == 0) values_.erase(name);
    }
    const std::string& name = node.outputs[0];
    if (uses_[name] == 0) return;  // nothing takes it
    if (values_.count(name) == 1 || model_.tensors.count(name) == 1)
      refuse(node.offset, node.label(), "its output " + in_quotes(name) + " already exists");
    values_[name] = std::move(result);
  } catch (const OperatorRefusal& refusal) {
    refuse(node.offset, node.label(), refusal.what, refusal.mend);
  } catch (const FoldingLimit& limit) {
    refuse(node.offset, node.label(), limit.what, "certify a smaller network, or fold before exporting");
  }
}

void OnnxGraph::require_finite(const Node& node, const AffineMap& map) const {
  if (!map.is_finite())
    refuse(node.offset, node.label(), "its weights, or what they fold into, are not finite",
           "the training has diverged, or the file is damaged: take an earlier checkpoint");
}

bool OnnxGraph::is_value(const Node& node, std::size_t k) const {
  return k < node.inputs.size() && values_.count(node.inputs[k]) == 1;
}

const OnnxValue& OnnxGraph::value(const Node& node, std::size_t k) const {
  if (!is_value(node, k)) throw OperatorRefusal{"does not take the value that the node before it gives"};
  return values_.at(node.inputs[k]);
}

/// Input `k` where it is stored; null where the node leaves it out.
const OnnxTensor* OnnxGraph::constant(const Node& node, std::size_t k) const {
  if (k >= node.inputs.size() || node.inputs[k].empty()) return nullptr;
  const auto found = model_.tensors.find(node.inputs[k]);
  if (found == model_.tensors.end())
    throw OperatorRefusal{"takes " + in_quotes(node.inputs[k]) + " for an input that must be stored"};
  return &found->second;
}

const OnnxTensor& OnnxGraph::needed_constant(const Node& node, std::size_t k) const {
  const OnnxTensor* const tensor = constant(node, k);
  if (tensor == nullptr) throw OperatorRefusal{"lacks its weights or biases"};
  return *tensor;
}

/// Integers that older operator sets hold in an attribute, newer ones in input `k`.
std::vector<std::int64_t> OnnxGraph::integers(const Node& node, std::size_t k, const char* attribute) const {
  if (node.has(attribute)) return node.integers(attribute, {});
  const OnnxTensor* const tensor = constant(node, k);
  return tensor == nullptr ? std::vector<std::int64_t>{} : tensor->integers;
}

/// "fc1" from "fc1.weight"; a layer whose name is taken, or empty, is numbered.
std::string OnnxGraph::layer_name(const std::string& weight) {
  constexpr std::string_view kSuffix = ".weight";
  std::string name = weight;
  if (name.size() > kSuffix.size() &&
      name.compare(name.size() - kSuffix.size(), kSuffix.size(), kSuffix) == 0)
    name.resize(name.size() - kSuffix.size());
  const std::string number = std::to_string(layers_ + 1);
  ++layers_;
  while (name.empty() || !names_.insert(name).second)
    name = "layer" + number + (name.empty() ? "" : "_" + name);
  return name;
}

OnnxValue OnnxGraph::computed(const Node& node) {
  bool has_value = false;
  for (std::size_t k = 0; k < inputs_that_count(node); ++k) {
    const std::string& name = node.inputs[k];
    has_value = has_value || values_.count(name) == 1;
    if (!name.empty() && values_.count(name) == 0 && model_.tensors.count(name) == 0)
      throw OperatorRefusal{"takes " + in_quotes(name) + ", which is neither computed before it nor stored"};
  }
  if (!has_value) throw OperatorRefusal{"does not take the value that the node before it gives"};
  static const std::set<std::string> kAffine = {
      "Gemm", "MatMul", "Conv", "BatchNormalization", "AveragePool", "GlobalAveragePool", "Add", "Sub", "Mul",
      "Div",  "Neg",    "Sum"};
  static const std::set<std::string> kLayout = {"Identity", "Dropout",   "Cast",      "Flatten", "Reshape",
                                                "Squeeze",  "Unsqueeze", "Transpose", "Concat",  "Pad"};
  static const std::set<std::string> kActivation = {
      "Relu", "LeakyRelu", "PRelu", "Clip", "Abs", "Max", "Min", "HardSigmoid", "MaxPool", "GlobalMaxPool"};
  if (kAffine.count(node.type) == 1) return computed_affine(node);
  if (kLayout.count(node.type) == 1) return computed_layout(node);
  static const std::set<std::string> kSmoothRead = {"Tanh", "Sigmoid", "Softplus", "Elu",
                                                    "Celu", "Selu",    "Gelu",     "Swish"};
  if (kActivation.count(node.type) == 1) return computed_activation(node);
  if (kSmoothRead.count(node.type) == 1) return computed_smooth(node);
  const bool is_last = node.outputs[0] == model_.output;
  if (is_last && (node.type == "Softmax" || node.type == "LogSoftmax")) {
    notes_.insert("the last " + node.type + " is left out: everything is said of the logits");
    return value(node, 0);
  }
  throw OperatorRefusal{kOperators, is_unread_activation(node.type) ? kSmooth : kReexportOnnx};
}

OnnxValue OnnxGraph::applied(const Node& node, const AffineMap& map, const OnnxShape& shape,
                             const OnnxTensor* weight) {
  const OnnxValue& x = value(node, is_value(node, 0) ? 0 : 1);
  if (!x.map.is_identity() && !x.name.empty() && weight != nullptr)
    notes_.insert("linear operations that no activation separates are one layer");
  return {composed(map, x.map), shape, x.name.empty() && weight != nullptr ? weight->name : x.name};
}

OnnxValue OnnxGraph::computed_affine(const Node& node) {
  OnnxShape shape;
  if (node.type == "Gemm") {
    if (node.inputs.size() < 2 || node.inputs.size() > 3 || !is_value(node, 0) || node.inputs[1].empty())
      throw OperatorRefusal{"is not the input times weights plus biases"};
    const OnnxTensor& weight = needed_constant(node, 1);
    const AffineMap map = gemm_map(node, weight, constant(node, 2), value(node, 0).shape, shape);
    return applied(node, map, shape, &weight);
  }
  if (node.type == "MatMul") {
    const bool is_left = !is_value(node, 0);
    const OnnxTensor& weight = needed_constant(node, is_left ? 0 : 1);
    const AffineMap map = matmul_map(weight, is_left, value(node, is_left ? 1 : 0).shape, shape);
    return applied(node, map, shape, &weight);
  }
  if (node.type == "Conv") {
    const OnnxTensor& weight = needed_constant(node, 1);
    const AffineMap map = convolution_map(node, weight, constant(node, 2), value(node, 0).shape, shape);
    notes_.insert("convolutions are written as dense layers");
    return applied(node, map, shape, &weight);
  }
  if (node.type == "AveragePool" || node.type == "GlobalAveragePool")
    return applied(node, average_map(node, value(node, 0).shape, shape), shape, nullptr);
  if (node.type == "BatchNormalization") {
    OnnxValue result = value(node, 0);
    std::vector<const OnnxTensor*> parameters;
    for (std::size_t k = 1; k <= 4; ++k) parameters.push_back(&needed_constant(node, k));
    std::vector<Enclosed> factors, amounts;
    batch_normalization(node, parameters, result.shape, factors, amounts);
    scale_rows(result.map, factors);
    shift_rows(result.map, amounts, 1);
    notes_.insert("batch normalization in inference is folded");
    return result;
  }
  return elementwise(node);
}

/// Add, Sub, Mul, Div, Neg and Sum: of two values, or of a value and a constant.
OnnxValue OnnxGraph::elementwise(const Node& node) {
  if (node.type == "Neg") {
    OnnxValue result = value(node, 0);
    scale_rows(result.map, {{-1, 0}});
    return result;
  }
  if (node.inputs.size() != 2 && !(node.type == "Sum" && !node.inputs.empty()))
    throw OperatorRefusal{"has not two inputs"};
  const bool value_first = is_value(node, 0);
  OnnxValue result = value(node, value_first ? 0 : 1);
  for (std::size_t k = 1; k < node.inputs.size(); ++k) {
    const std::size_t other = value_first ? k : 0;
    const bool adds = node.type == "Add" || node.type == "Sum" || node.type == "Sub";
    const double sign = node.type == "Sub" ? -1 : 1;
    if (is_value(node, other)) {
      if (!adds) throw OperatorRefusal{"is no affine function of the network's input"};
      const OnnxValue& second = value(node, other);
      if (second.shape != result.shape) throw OperatorRefusal{"its inputs are of different shapes"};
      result.map = sum_of(result.map, second.map, sign);
      if (result.name.empty()) result.name = second.name;
      continue;
    }
    if (node.type == "Div" && !value_first) throw OperatorRefusal{"divides a constant by a value"};
    const OnnxTensor& tensor = needed_constant(node, other);
    const std::vector<Enclosed> numbers = broadcast(tensor, result.shape);
    if (adds) {
      if (!value_first && sign < 0) scale_rows(result.map, {{-1, 0}});
      shift_rows(result.map, numbers, value_first ? sign : 1);
    } else if (node.type == "Mul") {
      scale_rows(result.map, numbers);
    } else {
      for (std::size_t i = 0; i < result.map.rows.size(); ++i) {
        if (numbers[i].value == 0) throw OperatorRefusal{"divides by 0"};
        for (AffineEntry& entry : result.map.rows[i]) entry.factor = divided(entry.factor, numbers[i]);
        result.map.shift[i] = divided(result.map.shift[i], numbers[i]);
      }
    }
  }
  return result;
}

/// Pad with a constant, which is 0 unless input 2 says otherwise.
OnnxValue OnnxGraph::padded(const Node& node, const OnnxValue& x) const {
  const std::vector<std::int64_t> pads = integers(node, 1, "pads");
  const OnnxTensor* const filler = constant(node, 2);
  const std::size_t rank = x.shape.size();
  if (node.text("mode", "constant") != "constant") throw OperatorRefusal{"its mode is not constant"};
  if (pads.size() != 2 * rank) throw OperatorRefusal{"pads does not fit its input"};
  OnnxValue result{{}, {}, x.name};
  for (std::size_t d = 0; d < rank; ++d) {
    if (pads[d] < 0 || pads[rank + d] < 0 || pads[d] + pads[rank + d] > 1 << 20)
      throw OperatorRefusal{"pads does not fit its input"};
    result.shape.push_back(x.shape[d] + pads[d] + pads[rank + d]);
  }
  const auto count = element_count({result.shape.begin(), result.shape.end()});
  if (!count || *count > kMostRows) throw FoldingLimit{"its result has more than 2^20 entries"};
  Enclosed value{node.number("value", 0), 0};
  if (filler != nullptr && !filler->numbers.empty()) value.value = filler->numbers[0];
  result.map.inputs = x.map.inputs;
  for (std::int64_t i = 0; i < static_cast<std::int64_t>(*count); ++i) {
    std::int64_t rest = i, index = 0, factor = 1;
    bool is_inside = true;
    for (std::size_t d = rank; d-- > 0;) {
      const std::int64_t at = rest % result.shape[d] - pads[d];
      is_inside = is_inside && at >= 0 && at < x.shape[d];
      index += at * factor;
      factor *= x.shape[d];
      rest /= result.shape[d];
    }
    result.map.rows.push_back(is_inside ? x.map.rows[static_cast<std::size_t>(index)] : AffineMap::Row());
    result.map.shift.push_back(is_inside ? x.map.shift[static_cast<std::size_t>(index)] : value);
  }
  return result;
}

OnnxValue OnnxGraph::computed_layout(const Node& node) {
  OnnxValue result = value(node, 0);
  if (node.type == "Pad") return padded(node, result);
  const auto to_integer = [&node](const char* attribute, std::int64_t otherwise) {
    const double number = node.number(attribute, static_cast<double>(otherwise));
    if (!(std::fabs(number) < 1e9)) throw OperatorRefusal{std::string(attribute) + " is out of range"};
    return static_cast<std::int64_t>(number);
  };
  if (node.type == "Cast") {
    const std::int64_t to = to_integer("to", 0);
    if (to != static_cast<std::int64_t>(kOnnxFloat) && to != static_cast<std::int64_t>(kOnnxDouble))
      throw OperatorRefusal{"casts to a type that is neither float32 nor float64"};
  } else if (node.type == "Flatten") {
    const std::int64_t axis = to_integer("axis", 1);
    const std::size_t at = axis == static_cast<std::int64_t>(result.shape.size())
                               ? result.shape.size()
                               : axis_of(axis, result.shape.size());
    const OnnxShape front(result.shape.begin(), result.shape.begin() + static_cast<std::ptrdiff_t>(at));
    result.shape = {count_of(front), count_of(result.shape) / count_of(front)};
  } else if (node.type == "Reshape") {
    result.shape = reshaped(result.shape, integers(node, 1, "shape"), to_integer("allowzero", 0) != 0);
  } else if (node.type == "Squeeze" || node.type == "Unsqueeze") {
    const std::vector<std::int64_t> axes = integers(node, 1, "axes");
    const bool adds = node.type == "Unsqueeze";
    const std::size_t rank = adds ? result.shape.size() + axes.size() : result.shape.size();
    if (rank > 16) throw OperatorRefusal{"its result has too many dimensions"};
    std::set<std::size_t> named;
    for (const std::int64_t axis : axes) named.insert(axis_of(axis, rank));
    OnnxShape shape;
    std::size_t next = 0;
    for (std::size_t d = 0; d < rank; ++d) {
      const bool is_named = named.count(d) == 1 || (!adds && axes.empty() && result.shape[d] == 1);
      if (adds) {
        shape.push_back(is_named ? 1 : result.shape.at(std::min(next++, result.shape.size() - 1)));
      } else if (!is_named) {
        shape.push_back(result.shape[d]);
      }
    }
    if (count_of(shape) != count_of(result.shape)) throw OperatorRefusal{"its axes do not fit its input"};
    result.shape = shape;
  } else if (node.type == "Transpose") {
    OnnxShape shape;
    result.map = selected(result.map, transposition(result.shape, node.integers("perm", {}), shape));
    result.shape = shape;
  } else if (node.type == "Concat") {
    const std::size_t axis = axis_of(to_integer("axis", 0), result.shape.size());
    std::int64_t before = 1, after = 1;
    for (std::size_t d = 0; d < axis; ++d) before *= result.shape[d];
    for (std::size_t d = axis + 1; d < result.shape.size(); ++d) after *= result.shape[d];
    std::vector<const AffineMap*> maps;
    std::vector<int> offset, size;
    int rows = 0;
    std::uint64_t entries = 0;
    OnnxShape shape = result.shape;
    shape[axis] = 0;
    for (std::size_t k = 0; k < node.inputs.size(); ++k) {
      const OnnxValue& part = value(node, k);
      OnnxShape own = part.shape;
      if (own.size() != shape.size()) throw OperatorRefusal{"its inputs are of different shapes"};
      std::swap(own[axis], shape[axis]);
      const std::int64_t total = std::exchange(own[axis], 0);
      const std::int64_t extent = std::exchange(shape[axis], 0);
      if (own != shape) throw OperatorRefusal{"its inputs are of different shapes"};
      shape[axis] = total + extent;
      maps.push_back(&part.map);
      offset.push_back(rows);
      size.push_back(static_cast<int>(extent * after));
      rows += part.map.outputs();
      entries += part.map.entries();
      if (static_cast<std::uint64_t>(rows) > kMostRows || entries > kMostElements)
        throw FoldingLimit{"the folded layer has more than 2^25 numbers"};
    }
    const AffineMap all = stacked(maps);
    std::vector<int> which;
    for (int b = 0; b < static_cast<int>(before); ++b)
      for (std::size_t k = 0; k < maps.size(); ++k)
        for (int i = 0; i < size[k]; ++i) which.push_back(offset[k] + b * size[k] + i);
    result.map = selected(all, which);
    result.shape = shape;
  }
  return result;
}

}  // namespace swarmcert::files
