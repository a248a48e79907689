#include "nn/weights/onnx/graph.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "nn/base/input_error.h"
#include "nn/base/text.h"
#include "nn/weights/tensors.h"

namespace swarmcert::files {
namespace {

constexpr char kOperators[] =
    "is not one of the supported operators: Gemm, MatMul, Conv, BatchNormalization, AveragePool, "
    "MaxPool, Add, Sub, Mul, Div, Relu, LeakyRelu, PRelu, Clip, HardSigmoid, Abs, Max, Min, Tanh, Sigmoid, "
    "Softplus, Elu, Gelu, TopK, Split with Max and Min for MaxMin, Flatten, Reshape, Transpose, Concat and "
    "the like";
constexpr char kSmooth[] =
    "omit it from the exported model if it is the last node; a network with it between its layers is not "
    "supported: train with ReLU, LeakyReLU, Hardtanh, tanh, sigmoid, softplus, ELU, SELU, SiLU or GELU";

bool is_unread_activation(const std::string& type) {
  static const std::set<std::string> kTypes = {"Erf", "Exp", "Mish", "HardSwish", "Softsign"};
  return kTypes.count(type) == 1;
}

std::size_t inputs_that_count(const OnnxNode& node) {
  const bool only_first = node.type == "BatchNormalization" || node.type == "Dropout";
  return only_first ? std::min<std::size_t>(1, node.inputs.size()) : node.inputs.size();
}

bool is_part_of_sorting(const std::string& type) {
  return type == "Split" || type == "ReduceMax" || type == "ReduceMin" || type == "Sort";
}

}  // namespace

OnnxGraph::OnnxGraph(OnnxModel model, const std::string& path)
    : model_(std::move(model)), path_(path), chain_(0) {}

void OnnxGraph::refuse(std::size_t offset, const std::string& field, const std::string& what,
                       const std::string& hint) const {
  throw InputError({path_, "offset " + std::to_string(offset), field, "", what, hint});
}

Weights OnnxGraph::run() {
  const OnnxShape shape = input_shape();
  const auto count = element_count({shape.begin(), shape.end()});
  if (!count || *count > kMostRows) refuse(0, in_quotes(model_.input.name), "has more than 2^20 entries");
  chain_ = ReluChain(static_cast<int>(*count));
  values_[model_.input.name] = {identity_map(static_cast<int>(*count)), shape, ""};
  std::set<std::string> used;
  for (const Node& node : model_.nodes) used.insert(node.inputs.begin(), node.inputs.end());
  for (const auto& [name, tensor] : model_.tensors)
    if (used.count(name) == 0) model_.unused.push_back(name + ": no node uses it");
  join_sorting();
  join_smooth_activations();
  count_uses();
  if (!shape.empty() && shape[0] > 1)
    notes_.insert("the input is a whole batch of " + std::to_string(shape[0]) + ", as the model states it");
  for (const Node& node : model_.nodes) follow(node);
  const auto output = values_.find(model_.output);
  if (output == values_.end())
    refuse(0, in_quotes(model_.output), "the graph's output is not where its chain of nodes ends");
  OnnxValue& last = output->second;
  if (!chain_.has_layers() && last.map.is_identity()) refuse(0, "", "the graph has no linear layer");
  const bool ends_in_activation = chain_.has_layers() && last.map.is_identity();
  if (ends_in_activation)
    notes_.insert(std::string("the network ends in a ") + function_of(chain_.last_activation()).words +
                  ", which an identity layer follows");
  Weights weights;
  try {
    weights.layers = chain_.finished(last.map, layer_name(last.name));
    weights.layers.back().is_added = ends_in_activation;
  } catch (const FoldingLimit& limit) {
    refuse(0, in_quotes(model_.output), limit.what, "certify a smaller network");
  }
  bool is_double = false;
  for (const auto& [name, tensor] : model_.tensors) is_double = is_double || tensor.type == kOnnxDouble;
  weights.precision = is_double ? Precision::kFloat64 : least_precision(weights.layers);
  for (std::size_t k = 1; k < weights.layers.size(); ++k)
    if (weights.layers[k - 1].activation ==
        Activation::kSelu)  // its slopes, as if they scaled the next matrix
      weights.layers[k].weight_rounding += kSeluRounding * norm_up(weights.layers[k].weights);
  weights.notes.assign(notes_.begin(), notes_.end());
  weights.data_files = std::move(model_.data_files);
  weights.unused = std::move(model_.unused);
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

/// Returns a tensor that is stored, held by a Constant node or passed on by an Identity node; null if there is none.
const OnnxTensor* OnnxGraph::stored_anywhere(const std::string& name) const {
  const auto stored = model_.tensors.find(name);
  if (stored != model_.tensors.end()) return &stored->second;
  std::string wanted = name;
  for (auto node = model_.nodes.rbegin(); node != model_.nodes.rend(); ++node) {
    if (node->outputs[0] != wanted) continue;
    if (node->type == "Constant") return &*node->attributes.at("value").tensor;
    if (node->type != "Identity" || node->inputs.size() != 1) return nullptr;
    wanted = node->inputs[0];
    const auto found = model_.tensors.find(wanted);
    if (found != model_.tensors.end()) return &found->second;
  }
  return nullptr;
}

/// Infers the size of the input, if the file does not state it, from the first node with weights.
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
    if (follow_constant(node)) {
      if (node.type != "Constant") require_all_read(node);
      return;
    }
    OnnxValue result = computed(node);
    require_all_read(node);
    require_finite(node, result.map);
    for (std::size_t k = 0; k < inputs_that_count(node); ++k) {
      const std::string& name = node.inputs[k];
      if (--uses_[name] == 0) values_.erase(name);
    }
    const std::string& name = node.outputs[0];
    if (uses_[name] == 0) return;  // its output is unused
    if (values_.count(name) == 1 || model_.tensors.count(name) == 1)
      refuse(node.offset, node.label(), "its output " + in_quotes(name) + " already exists");
    values_[name] = std::move(result);
  } catch (const OperatorRefusal& refusal) {
    refuse(node.offset, node.label(), refusal.what, refusal.hint);
  } catch (const FoldingLimit& limit) {
    refuse(node.offset, node.label(), limit.what, "certify a smaller network, or fold before exporting");
  }
}

void OnnxGraph::require_all_read(const Node& node) {
  const std::string attribute = node.unread_attribute();
  if (!attribute.empty()) throw OperatorRefusal{"its attribute " + in_quotes(attribute) + " is not known"};
}

void OnnxGraph::require_finite(const Node& node, const AffineMap& map) const {
  if (!map.is_finite())
    refuse(node.offset, node.label(), "its weights, or their folded values, are not finite",
           "the training has diverged, or the file is damaged: take an earlier checkpoint");
}

bool OnnxGraph::is_value(const Node& node, std::size_t k) const {
  return k < node.inputs.size() && values_.count(node.inputs[k]) == 1;
}

const OnnxValue& OnnxGraph::value(const Node& node, std::size_t k) const {
  if (!is_value(node, k)) throw OperatorRefusal{"does not use the output of the preceding node"};
  return values_.at(node.inputs[k]);
}

/// Returns input `k` if it is stored; null if the node omits it.
const OnnxTensor* OnnxGraph::constant(const Node& node, std::size_t k) const {
  if (k >= node.inputs.size() || node.inputs[k].empty()) return nullptr;
  const auto found = model_.tensors.find(node.inputs[k]);
  if (found == model_.tensors.end())
    throw OperatorRefusal{"uses " + in_quotes(node.inputs[k]) + " as an input that must be stored"};
  return &found->second;
}

const OnnxTensor& OnnxGraph::needed_constant(const Node& node, std::size_t k) const {
  const OnnxTensor* const tensor = constant(node, k);
  if (tensor == nullptr) throw OperatorRefusal{"lacks its weights or biases"};
  return *tensor;
}

/// Returns integers that are an attribute in older operator sets and input `k` in newer ones.
std::vector<std::int64_t> OnnxGraph::integers(const Node& node, std::size_t k, const char* attribute) const {
  if (node.has(attribute)) return node.integers(attribute, {});
  const OnnxTensor* const tensor = constant(node, k);
  return tensor == nullptr ? std::vector<std::int64_t>{} : tensor->integers;
}

/// Returns "fc1" for "fc1.weight"; a layer whose name is empty or already used gets a number.
std::string OnnxGraph::layer_name(const std::string& weight) {
  constexpr std::string_view kSuffix = ".weight";
  std::string name = weight;
  if (name.size() > kSuffix.size() && ends_with(name, kSuffix)) name.resize(name.size() - kSuffix.size());
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
      throw OperatorRefusal{"uses " + in_quotes(name) + ", which is neither stored nor computed before it"};
  }
  if (!has_value) throw OperatorRefusal{"does not use the output of the preceding node"};
  static const std::set<std::string> kAffine = {
      "Gemm", "MatMul", "Conv", "BatchNormalization", "AveragePool", "GlobalAveragePool", "Add", "Sub", "Mul",
      "Div",  "Neg",    "Sum"};
  static const std::set<std::string> kLayout = {"Identity", "Dropout",   "Cast",      "Flatten", "Reshape",
                                                "Squeeze",  "Unsqueeze", "Transpose", "Concat",  "Pad"};
  static const std::set<std::string> kActivation = {
      "Relu", "LeakyRelu", "PRelu", "Clip", "Abs", "Max", "Min", "HardSigmoid", "MaxPool", "GlobalMaxPool"};
  if (joined_.count(node.outputs[0]) == 1) return sorted_by_concat(node);
  if (node.type == "TopK") return sorted_by_top(node);
  if (kAffine.count(node.type) == 1) return computed_affine(node);
  if (kLayout.count(node.type) == 1) return computed_layout(node);
  static const std::set<std::string> kSmoothRead = {"Tanh", "Sigmoid", "Softplus", "Elu",
                                                    "Celu", "Selu",    "Gelu",     "Swish"};
  if (kActivation.count(node.type) == 1) return computed_activation(node);
  if (kSmoothRead.count(node.type) == 1) return computed_smooth(node);
  const bool is_last = node.outputs[0] == model_.output;
  if (is_last && (node.type == "Softmax" || node.type == "LogSoftmax")) {
    notes_.insert("the final " + node.type + " is omitted: all results are for the logits");
    return value(node, 0);
  }
  throw OperatorRefusal{kOperators, is_unread_activation(node.type) ? kSmooth
                                    : is_part_of_sorting(node.type) ? kReadSorting
                                                                    : kReexportOnnx};
}

/// Refuses Dropout and BatchNormalization in training mode, which is stated by an attribute, an input, or, for
/// BatchNormalization before operator set 14, by the number of outputs.
void OnnxGraph::require_inference(const Node& node) const {
  bool trains = node.number("training_mode", 0) != 0 || node.number("is_test", 1) == 0;
  if (node.type == "Dropout") {
    const OnnxTensor* const mode = constant(node, 2);
    trains = trains || (mode != nullptr && mode->integers != std::vector<std::int64_t>{0});
  } else if (!node.has("is_test")) {
    const auto named = std::count_if(node.outputs.begin(), node.outputs.end(),
                                     [](const std::string& name) { return !name.empty(); });
    trains = trains || named > 1;
  }
  if (trains) throw OperatorRefusal{"is in training mode", "export the model after model.eval()"};
}

/// Refuses a constant that operator sets before 7 align with other axes than the last ones of the value.
void OnnxGraph::require_trailing_axes(const Node& node, const OnnxTensor& tensor,
                                      const OnnxShape& shape) const {
  const std::size_t own = tensor.shape.size(), rank = shape.size();
  if (tensor.numbers.size() == 1 || own >= rank) return;
  const bool is_by_channel = node.type == "PRelu" && model_.operator_set > 0 && model_.operator_set < 7;
  const double axis = node.number("axis", is_by_channel ? 1 : static_cast<double>(rank - own));
  if (axis != static_cast<double>(rank - own) && axis != -static_cast<double>(own))
    throw OperatorRefusal{"aligns its constant with other axes than the last ones, as before operator set 7",
                          "export with operator set 7 or newer: torch.onnx.export(..., opset_version=17)"};
}

OnnxValue OnnxGraph::applied(const Node& node, const AffineMap& map, const OnnxShape& shape,
                             const OnnxTensor* weight) {
  const OnnxValue& x = value(node, is_value(node, 0) ? 0 : 1);
  if (!x.map.is_identity() && !x.name.empty() && weight != nullptr)
    notes_.insert("linear operations without an activation between them are folded into one layer");
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
    require_inference(node);
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

/// Handles Add, Sub, Mul, Div, Neg and Sum, of two values or of a value and a constant.
OnnxValue OnnxGraph::elementwise(const Node& node) {
  if (node.type == "Neg") {
    OnnxValue result = value(node, 0);
    scale_rows(result.map, {{-1, 0}});
    return result;
  }
  if (node.inputs.size() != 2 && !(node.type == "Sum" && !node.inputs.empty()))
    throw OperatorRefusal{"does not have two inputs"};
  std::size_t base = 0;  // the first value; constants may come before it
  while (base < node.inputs.size() && !is_value(node, base)) ++base;
  OnnxValue result = value(node, base);
  for (std::size_t other = 0; other < node.inputs.size(); ++other) {
    if (other == base) continue;
    const bool adds = node.type == "Add" || node.type == "Sum" || node.type == "Sub";
    const double sign = node.type == "Sub" ? -1 : 1;
    if (is_value(node, other)) {
      if (!adds) throw OperatorRefusal{"is not an affine function of the network's input"};
      const OnnxValue& second = value(node, other);
      if (second.shape != result.shape) throw OperatorRefusal{"its inputs are of different shapes"};
      result.map = sum_of(result.map, second.map, sign);
      if (result.name.empty()) result.name = second.name;
      continue;
    }
    if (node.type == "Div" && base > 0) throw OperatorRefusal{"divides a constant by a value"};
    const OnnxTensor& tensor = needed_constant(node, other);
    require_trailing_axes(node, tensor, result.shape);
    const std::vector<Enclosed> numbers = broadcast(tensor, result.shape);
    if (adds) {
      if (base > 0 && sign < 0) scale_rows(result.map, {{-1, 0}});
      shift_rows(result.map, numbers, base > 0 ? 1 : sign);
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

}  // namespace swarmcert::files
