/// MaxMin and GroupSort of an ONNX graph: groups of nodes that PyTorch exports, and TopK.
#include <algorithm>
#include <utility>

#include "nn/weights/onnx/graph.h"

namespace swarmcert::files {
namespace {

bool takes(const OnnxNode& node, const char* type, const std::string& a, const std::string& b) {
  return node.type == type && node.inputs.size() == 2 && node.outputs.size() == 1 &&
         ((node.inputs[0] == a && node.inputs[1] == b) || (node.inputs[0] == b && node.inputs[1] == a));
}

std::int64_t integer(const OnnxNode& node, const char* attribute, std::int64_t otherwise) {
  const double number = node.number(attribute, static_cast<double>(otherwise));
  if (!(number >= -16 && number <= 1 << 20))
    throw OperatorRefusal{std::string(attribute) + " is out of range", kReadSorting};
  return static_cast<std::int64_t>(number);
}

/// Each number of a group takes a layer of ReLU.
constexpr int kLargestGroupWithRelu = 8;

void require_sorting(bool condition, const char* what) {
  if (!condition) throw OperatorRefusal{what, kReadSorting};
}

/// Returns whether all dimensions before `axis` have size 1.
bool is_first(const OnnxShape& shape, std::size_t axis) {
  return std::all_of(shape.begin(), shape.begin() + static_cast<std::ptrdiff_t>(axis),
                     [](std::int64_t size) { return size == 1; });
}

}  // namespace

std::vector<OnnxNode*> OnnxGraph::users_of(const std::string& name) {
  std::vector<OnnxNode*> found;
  for (OnnxNode& node : model_.nodes)
    if (std::count(node.inputs.begin(), node.inputs.end(), name) > 0) found.push_back(&node);
  return name == model_.output ? std::vector<OnnxNode*>{} : found;
}

/// Returns the Concat that alone uses the results of two nodes, the larger numbers first; null if there is none.
OnnxNode* OnnxGraph::joined_by_concat(const std::vector<OnnxNode*>& pair) {
  OnnxNode* const first = only_user(pair[0]->outputs[0]);
  OnnxNode* const second = only_user(pair[1]->outputs[0]);
  const bool joins = first != nullptr && first == second && first->type == "Concat" &&
                     first->inputs == std::vector<std::string>{pair[0]->outputs[0], pair[1]->outputs[0]};
  return joins ? first : nullptr;
}

/// Replaces each group by its Concat alone, with the inputs of the group: see sorted_by_concat().
void OnnxGraph::join_sorting() {
  for (OnnxNode& node : model_.nodes) {
    const bool splits = node.type == "Split" && node.outputs.size() == 2 && !node.inputs.empty();
    const bool reduces = node.type == "ReduceMax" && node.outputs.size() == 1 && !node.inputs.empty();
    if (!splits && !reduces) continue;
    const std::string from = node.inputs[0];
    std::vector<OnnxNode*> pair = users_of(splits ? node.outputs[0] : from);
    const char* const larger = splits ? "Max" : "ReduceMax";
    if (pair.size() != 2) continue;
    if (pair[0]->type != larger) std::swap(pair[0], pair[1]);
    if (splits) {
      if (users_of(node.outputs[1]).size() != 2 ||
          !takes(*pair[0], "Max", node.outputs[0], node.outputs[1]) ||
          !takes(*pair[1], "Min", node.outputs[0], node.outputs[1]))
        continue;
    } else if (pair[0] != &node || pair[1]->type != "ReduceMin" || pair[1]->inputs.empty() ||
               pair[1]->inputs[0] != from || pair[1]->outputs.size() != 1) {
      continue;
    }
    OnnxNode* const concat = joined_by_concat(pair);
    if (concat == nullptr) continue;
    joined_[concat->outputs[0]] =
        splits ? std::vector<OnnxNode>{node} : std::vector<OnnxNode>{*pair[0], *pair[1]};
    concat->inputs = {from};
    for (OnnxNode* const other : {&node, pair[0], pair[1]}) other->type.clear();
  }
}

/// Orders the rows of each pair with ReLU, the larger one at its second place: max(a, b) = b + relu(a - b) and
/// min(a, b) = b - relu(b - a). Rows in no pair are carried.
AffineMap OnnxGraph::ordered(const Node& node, const AffineMap& map, const std::string& name,
                             const std::vector<std::pair<int, int>>& pairs) {
  std::vector<int> smaller_at, larger_at, others, place(static_cast<std::size_t>(map.outputs()), -1);
  for (const auto& [smaller, larger] : pairs) {
    place[static_cast<std::size_t>(smaller)] = static_cast<int>(smaller_at.size());
    place[static_cast<std::size_t>(larger)] = static_cast<int>(pairs.size() + larger_at.size());
    smaller_at.push_back(smaller);
    larger_at.push_back(larger);
  }
  for (int i = 0; i < map.outputs(); ++i) {
    int& at = place[static_cast<std::size_t>(i)];
    if (at >= 0) continue;
    at = static_cast<int>(2 * pairs.size() + others.size());
    others.push_back(i);
  }
  AffineMap base = selected(map, smaller_at), rest = selected(map, others);
  const AffineMap difference = sum_of(selected(map, larger_at), base, -1);
  AffineMap opposite = difference;
  scale_rows(opposite, {{-1, 0}});
  const AffineMap rectified = relu(node, stacked({&difference, &opposite}), name, {&base, &rest});
  std::vector<int> first, second;
  for (int k = 0; k < difference.outputs(); ++k) {
    first.push_back(k);
    second.push_back(difference.outputs() + k);
  }
  const AffineMap larger = sum_of(base, selected(rectified, first), 1);
  const AffineMap smaller = sum_of(base, selected(rectified, second), -1);
  return selected(stacked({&smaller, &larger, &rest}), place);
}

/// Returns the sorted value beside a skip connection, past which the sorting itself cannot be stated.
AffineMap OnnxGraph::sorted_with_relu(const Node& node, const OnnxValue& x, Activation activation) {
  const int size = x.map.outputs();
  notes_.insert(
      "MaxMin and GroupSort beside a skip connection are written with ReLU: max(a, b) = b + relu(a - b)");
  std::vector<std::pair<int, int>> pairs;
  std::vector<int> which;
  if (activation == Activation::kMaxMinHalves) {
    for (int i = 0; i < size / 2; ++i) pairs.emplace_back(size / 2 + i, i);
    return ordered(node, x.map, x.name, pairs);
  }
  if (activation == Activation::kMaxMinPairs) {
    for (int i = 0; i < size; i += 2) pairs.emplace_back(i + 1, i);
    for (int i = 0; i < size; i += 2) which.push_back(i);
    for (int i = 1; i < size; i += 2) which.push_back(i);
    return selected(ordered(node, x.map, x.name, pairs), which);
  }
  const int group = function_of(activation).group;
  if (group > kLargestGroupWithRelu)
    throw OperatorRefusal{"sorts groups of more than 8 numbers beside a skip connection",
                          "leave the skip connection out, or train with MaxMin or ReLU"};
  AffineMap result = x.map;
  for (int round = 0; round < group; ++round) {  // neighbours in turn: odd-even transposition sort
    pairs.clear();
    for (int i = 0; i + 1 < size; ++i)
      if (i % group + 1 < group && i % group % 2 == round % 2) pairs.emplace_back(i, i + 1);
    if (!pairs.empty()) result = ordered(node, result, round == 0 ? x.name : "", pairs);
  }
  return result;
}

/// Applies the activation to the whole value `x`, in memory order.
OnnxValue OnnxGraph::sorted(const Node& node, const OnnxValue& x, Activation activation) {
  if (!needed_after(node).empty()) return {sorted_with_relu(node, x, activation), x.shape, ""};
  const AffineMap result = chain_.activated(x.map, activation, {}, layer_name(x.name));
  for (auto& [value_name, value] : values_) value.name.clear();
  return {result, x.shape, ""};
}

OnnxValue OnnxGraph::sorted_by_concat(const Node& node) {
  const OnnxValue x = value(node, 0);
  const std::vector<Node>& group = joined_.at(node.outputs[0]);
  const std::size_t rank = x.shape.size();
  if (group.size() == 1) {  // Split
    const std::size_t axis = axis_of(integer(group[0], "axis", 0), rank);
    const std::vector<std::int64_t> sizes = integers(group[0], 1, "split");
    const std::int64_t half = x.shape[axis] / 2;
    require_sorting(x.shape[axis] == 2 * half && (sizes.empty() || sizes == std::vector{half, half}),
                    "joins parts that are not halves");
    require_sorting(axis_of(integer(node, "axis", 0), rank) == axis && is_first(x.shape, axis),
                    "does not join the halves of the whole layer along the axis of the Split before it");
    return sorted(node, x, Activation::kMaxMinHalves);
  }
  for (const Node& reduced : group) {
    const std::vector<std::int64_t> axes = integers(reduced, 1, "axes");
    require_sorting(rank >= 2 && axes.size() == 1 && axis_of(axes[0], rank) == rank - 1 &&
                        x.shape.back() == 2 && integer(reduced, "keepdims", 1) == 0,
                    "joins other maxima and minima than those of pairs along the last axis");
  }
  OnnxShape shape(x.shape.begin(), x.shape.end() - 1);
  require_sorting(axis_of(integer(node, "axis", 0), rank - 1) == rank - 2 && is_first(shape, rank - 2),
                  "does not join the maxima and minima of the whole layer");
  shape.back() *= 2;
  OnnxValue result = sorted(node, x, Activation::kMaxMinPairs);
  result.shape = std::move(shape);
  return result;
}

OnnxValue OnnxGraph::sorted_by_top(const Node& node) {
  const OnnxValue x = value(node, 0);
  const std::size_t rank = x.shape.size();
  std::vector<std::int64_t> count =
      node.has("k") ? std::vector<std::int64_t>{integer(node, "k", 0)} : needed_constant(node, 1).integers;
  require_sorting(rank > 0 && axis_of(integer(node, "axis", -1), rank) == rank - 1 &&
                      count == std::vector<std::int64_t>{x.shape.back()} && integer(node, "sorted", 1) == 1,
                  "does not sort the whole last axis");
  const std::int64_t size = x.shape.back();
  require_sorting(size >= 2 && size <= kLargestGroup, "sorts groups of less than 2 or more than 64 numbers");
  OnnxValue result = sorted(node, x, group_sort(static_cast<int>(size)));
  if (integer(node, "largest", 1) == 0) return result;
  std::vector<int> which;
  for (int i = 0; i < result.map.outputs(); ++i) {
    const int group = i - i % static_cast<int>(size);
    which.push_back(group + static_cast<int>(size) - 1 - (i - group));
  }
  result.map = selected(result.map, which);
  return result;
}

}  // namespace swarmcert::files
