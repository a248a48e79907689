/// Smooth activations of an ONNX graph: single nodes, and the groups of nodes that exporters write for SiLU and GELU.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "nn/base/input_error.h"
#include "nn/weights/onnx/graph.h"

namespace swarmcert::files {
namespace {

constexpr double kRootOfTwo = 1.41421356237309504880;
constexpr double kRootRounding = 1e-7;  ///< rounding error of sqrt 2 as float32
constexpr char kOtherParameters[] = "use the activation with its default parameters";

void require_parameter(const OnnxNode& node, const char* attribute, double value) {
  if (node.number(attribute, value) != value)
    throw OperatorRefusal{std::string(attribute) + " is not " + std::to_string(value), kOtherParameters};
}

/// Returns the other of two inputs; empty if `node` does not have exactly two inputs, one of which is `name`.
std::string other_input(const OnnxNode& node, const std::string& name) {
  if (node.inputs.size() != 2) return {};
  if (node.inputs[0] == name) return node.inputs[1];
  return node.inputs[1] == name ? node.inputs[0] : std::string();
}

Activation smooth_activation(const OnnxNode& node) {
  if (node.type == "Tanh") return Activation::kTanh;
  if (node.type == "Sigmoid") return Activation::kSigmoid;
  if (node.type == "Softplus") return Activation::kSoftplus;
  if (node.type == "Elu" || node.type == "Celu") {  // identical for alpha = 1
    require_parameter(node, "alpha", 1);
    return Activation::kElu;
  }
  if (node.type == "Selu") {  // the standard's default values, which are float32
    require_parameter(node, "alpha", 1.67326319217681884765625);
    require_parameter(node, "gamma", 1.05070102214813232421875);
    return Activation::kSelu;
  }
  if (node.type == "Gelu") {
    if (node.text("approximate", "none") != "none")
      throw OperatorRefusal{"approximate is not none", kOtherParameters};
    return Activation::kGelu;
  }
  require_parameter(node, "alpha", 1);  // Swish
  return Activation::kSilu;
}

}  // namespace

/// Returns the only node that uses `name`; null if there are several, there is none, or it is the graph's output.
OnnxNode* OnnxGraph::only_user(const std::string& name) {
  OnnxNode* found = nullptr;
  for (OnnxNode& node : model_.nodes) {
    const auto times = std::count(node.inputs.begin(), node.inputs.end(), name);
    if (times > 1 || (times == 1 && found != nullptr)) return nullptr;
    if (times == 1) found = &node;
  }
  return name == model_.output ? nullptr : found;
}

/// Returns whether `name` is a stored number that differs from `wanted` by at most `error`.
bool OnnxGraph::holds(const std::string& name, double wanted, double error) const {
  const OnnxTensor* const tensor = name.empty() ? nullptr : stored_anywhere(name);
  return tensor != nullptr && tensor->numbers.size() == 1 &&
         std::fabs(tensor->numbers.front() - wanted) <= error;
}

/// Replaces x Sigmoid(x) by a single node Swish, and x (1 + Erf(x / sqrt 2)) 0.5, in the order in which PyTorch exports
/// it, by a single node Gelu.
void OnnxGraph::join_smooth_activations() {
  const auto replace = [](OnnxNode& last, const char* type, const std::string& input,
                          const std::vector<OnnxNode*>& others) {
    last.type = type;
    last.inputs = {input};
    for (OnnxNode* const other : others) other->type.clear();
  };
  for (OnnxNode& node : model_.nodes) {
    if (node.type != "Sigmoid" && node.type != "Erf") continue;
    if (node.inputs.size() != 1 || node.outputs.size() != 1) continue;
    const std::string from = node.inputs[0];
    OnnxNode* const user = only_user(node.outputs[0]);
    if (user == nullptr) continue;
    if (node.type == "Sigmoid") {
      if (user->type == "Mul" && other_input(*user, node.outputs[0]) == from)
        replace(*user, "Swish", from, {&node});
      continue;
    }
    const auto writes = [&from](const OnnxNode& other) {
      return other.outputs.size() == 1 && other.outputs[0] == from;
    };
    const auto quotient = std::find_if(model_.nodes.begin(), model_.nodes.end(), writes);
    if (quotient == model_.nodes.end() || quotient->type != "Div" || quotient->inputs.size() != 2 ||
        !holds(quotient->inputs[1], kRootOfTwo, kRootRounding) || only_user(from) != &node)
      continue;
    const std::string x = quotient->inputs[0];
    if (user->type != "Add" || !holds(other_input(*user, node.outputs[0]), 1, 0)) continue;
    OnnxNode* const product = only_user(user->outputs[0]);
    if (product == nullptr || product->type != "Mul" || other_input(*product, user->outputs[0]) != x)
      continue;
    OnnxNode* const half = only_user(product->outputs[0]);
    if (half == nullptr || half->type != "Mul" || !holds(other_input(*half, product->outputs[0]), 0.5, 0))
      continue;
    replace(*half, "Gelu", x, {&node, &*quotient, user, product});
    notes_.insert(
        "GELU is evaluated with the exact sqrt 2; the rounded value in the file does not change its slopes");
  }
  const auto is_joined = [](const OnnxNode& node) { return node.type.empty(); };
  model_.nodes.erase(std::remove_if(model_.nodes.begin(), model_.nodes.end(), is_joined), model_.nodes.end());
}

/// Returns the values computed so far that nodes after `node` use.
std::vector<AffineMap*> OnnxGraph::needed_after(const Node& node) {
  std::vector<AffineMap*> needed;
  for (auto& [value_name, value] : values_) {
    const auto own = std::count(node.inputs.begin(), node.inputs.end(), value_name);
    if (uses_[value_name] > own) needed.push_back(&value.map);
  }
  return needed;
}

OnnxValue OnnxGraph::computed_smooth(const Node& node) {
  const OnnxValue x = value(node, 0);
  const Activation activation = smooth_activation(node);
  const AffineMap activated = chain_.activated(x.map, activation, needed_after(node), layer_name(x.name));
  for (auto& [value_name, value] : values_) value.name.clear();
  return {activated, x.shape, ""};
}

}  // namespace swarmcert::files
