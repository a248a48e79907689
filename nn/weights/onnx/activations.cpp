/// Piecewise linear functions of an ONNX graph, rewritten with ReLU, and constants computed from constants.
#include <algorithm>
#include <cmath>
#include <utility>

#include "nn/base/input_error.h"
#include "nn/weights/onnx/graph.h"
#include "nn/weights/tensors.h"

namespace swarmcert::files {
namespace {

AffineMap scaled(AffineMap map, double factor) {
  scale_rows(map, {{factor, 0}});
  return map;
}

AffineMap shifted(AffineMap map, const std::vector<Enclosed>& amounts, double sign) {
  shift_rows(map, amounts, sign);
  return map;
}

std::vector<Enclosed> negated(std::vector<Enclosed> numbers) {
  for (Enclosed& number : numbers) number.value = -number.value;
  return numbers;
}

/// Refuses a cast of stored numbers that would change one of them.
void require_exact_cast(const OnnxNode& node, const std::vector<double>& numbers) {
  const double to = node.number("to", 0);
  const auto is_kept = [to](double number) {
    if (to == static_cast<double>(kOnnxDouble)) return true;
    if (to == static_cast<double>(kOnnxFloat))
      return static_cast<double>(static_cast<float>(number)) == number;
    const bool is_integer = to == static_cast<double>(kOnnxInt32) || to == static_cast<double>(kOnnxInt64);
    return is_integer && std::fabs(number) < 0x1p31 && std::trunc(number) == number;
  };
  if (!std::all_of(numbers.begin(), numbers.end(), is_kept))
    throw OperatorRefusal{"rounds stored numbers",
                          "fold constants: torch.onnx.export(..., do_constant_folding=True)"};
}

/// Returns the sizes `start` to `end` - 1 of a shape, both counted from the end if negative and limited to the rank.
OnnxShape stated_sizes(const OnnxNode& node, const OnnxShape& shape) {
  const auto rank = static_cast<double>(shape.size());
  const auto place = [&](const char* attribute, double otherwise) {
    const double at = node.number(attribute, otherwise);
    return static_cast<std::ptrdiff_t>(std::min(rank, std::max(0.0, at < 0 ? at + rank : at)));
  };
  const std::ptrdiff_t start = place("start", 0), end = std::max(start, place("end", rank));
  return {shape.begin() + start, shape.begin() + end};
}

}  // namespace

/// Adds a ReLU layer and carries along every value that a later node uses.
AffineMap OnnxGraph::relu(const Node& node, const AffineMap& rows, const std::string& name,
                          const std::vector<AffineMap*>& also_carried) {
  std::vector<AffineMap*> carried = also_carried;
  for (AffineMap* const needed : needed_after(node)) carried.push_back(needed);
  const std::string layer = layer_name(name);
  AffineMap result = chain_.relu(rows, carried, layer);
  for (auto& [value_name, value] : values_) value.name.clear();
  // Other values remain maps of the previous layer; only this node refers to them, and it no longer needs them.
  return result;
}

/// Returns shift + sum of factors[k] relu(terms[k]).
OnnxValue OnnxGraph::sum_of_relus(const Node& node, const OnnxValue& x, const std::vector<AffineMap>& terms,
                                  const std::vector<std::vector<Enclosed>>& factors,
                                  const std::vector<Enclosed>& shift) {
  const OnnxShape shape = x.shape;
  const std::string name = x.name;
  std::vector<const AffineMap*> pointers;
  for (const AffineMap& term : terms) pointers.push_back(&term);
  const AffineMap rectified = relu(node, stacked(pointers), name, {});
  const auto size = static_cast<int>(count_of(shape));
  OnnxValue result;
  result.shape = shape;
  for (std::size_t k = 0; k < terms.size(); ++k) {
    std::vector<int> which;
    for (int i = 0; i < size; ++i) which.push_back(static_cast<int>(k) * size + i);
    AffineMap part = selected(rectified, which);
    scale_rows(part, factors[k]);
    result.map = k == 0 ? std::move(part) : sum_of(result.map, part, 1);
  }
  if (!shift.empty()) shift_rows(result.map, shift, 1);
  return result;
}

OnnxValue OnnxGraph::computed_activation(const Node& node) {
  if (node.type == "Max" || node.type == "Min") return largest_of_inputs(node);
  const OnnxValue x = value(node, 0);
  const Enclosed one{1, 0};
  if (node.type == "Relu") return sum_of_relus(node, x, {x.map}, {{one}}, {});
  if (node.type == "MaxPool" || node.type == "GlobalMaxPool") {
    OnnxShape shape;
    std::vector<std::vector<int>> windows = max_windows(node, x.shape, shape);
    notes_.insert("max-pooling is written with ReLU: max(a, b) = b + relu(a - b)");
    return largest(node, x, std::move(windows), std::move(shape));
  }
  if (node.type == "Abs") return sum_of_relus(node, x, {x.map, scaled(x.map, -1)}, {{one}, {one}}, {});
  if (node.type == "LeakyRelu" || node.type == "PRelu") {
    if (node.type == "PRelu") require_trailing_axes(node, needed_constant(node, 1), x.shape);
    const std::vector<Enclosed> slopes =
        node.type == "PRelu" ? broadcast(needed_constant(node, 1), x.shape)
                             : std::vector<Enclosed>{{node.number("alpha", static_cast<double>(0.01F)), 0}};
    notes_.insert(node.type + " with the slope a below 0 is written with ReLU: relu(x) - a relu(-x)");
    return sum_of_relus(node, x, {x.map, scaled(x.map, -1)}, {{one}, negated(slopes)}, {});
  }
  if (node.type == "HardSigmoid") {
    OnnxValue line = x;
    scale_rows(line.map, {{node.number("alpha", static_cast<double>(0.2F)), 0}});
    shift_rows(line.map, {{node.number("beta", 0.5), 0}}, 1);
    OnnxTensor least, most;
    least.is_read = most.is_read = true;
    least.numbers = {0};
    most.numbers = {1};
    return clipped(node, line, &least, &most);
  }
  OnnxTensor attribute_least, attribute_most;  // attributes of Clip before operator set 11
  const OnnxTensor* least = constant(node, 1);
  const OnnxTensor* most = constant(node, 2);
  const auto take = [&node](const char* name, OnnxTensor& tensor, const OnnxTensor*& limit) {
    if (!node.has(name)) return;
    tensor.is_read = true;
    tensor.numbers = {node.number(name, 0)};
    limit = &tensor;
  };
  take("min", attribute_least, least);
  take("max", attribute_most, most);
  return clipped(node, x, least, most);
}

/// Returns min(max(x, least), most) = least + relu(x - least) - relu(x - most). Each limit may be missing.
OnnxValue OnnxGraph::clipped(const Node& node, const OnnxValue& x, const OnnxTensor* least,
                             const OnnxTensor* most) {
  const Enclosed one{1, 0}, minus_one{-1, 0};
  const auto limits = [&x](const OnnxTensor* tensor, double outwards) {
    std::vector<Enclosed> numbers;
    if (tensor != nullptr) numbers = broadcast(*tensor, x.shape);
    const auto is_open = [outwards](const Enclosed& number) {
      return outwards * number.value > 0x1p127;  // the largest float32 means no limit
    };
    if (!numbers.empty() && std::all_of(numbers.begin(), numbers.end(), is_open))
      return std::vector<Enclosed>{};
    for (const Enclosed& number : numbers)
      if (!(std::fabs(number.value) <= 0x1p127))
        throw OperatorRefusal{"its minimum or maximum is not a number within 2^127",
                              "leave out a limit that no value reaches"};
    return numbers;
  };
  const std::vector<Enclosed> low = limits(least, -1), high = limits(most, 1);
  for (std::size_t i = 0; i < std::min(low.size(), high.size()); ++i)
    if (low[i].value > high[i].value) throw OperatorRefusal{"its minimum is above its maximum"};
  if (low.empty() && high.empty()) return x;
  if (high.empty()) return sum_of_relus(node, x, {shifted(x.map, low, -1)}, {{one}}, low);
  if (low.empty()) return sum_of_relus(node, x, {shifted(scaled(x.map, -1), high, 1)}, {{minus_one}}, high);
  notes_.insert("values clipped on both sides are written with ReLU: l + relu(x - l) - relu(x - h)");
  return sum_of_relus(node, x, {shifted(x.map, low, -1), shifted(x.map, high, -1)}, {{one}, {minus_one}},
                      low);
}

/// Reduces by pairwise max(a, b) = b + relu(a - b) until one entry of each window is left.
OnnxValue OnnxGraph::largest(const Node& node, OnnxValue from, std::vector<std::vector<int>> windows,
                             OnnxShape shape) {
  const auto is_reduced = [](const std::vector<int>& window) { return window.size() == 1; };
  while (!std::all_of(windows.begin(), windows.end(), is_reduced)) {
    std::vector<int> first, second, single;
    for (const std::vector<int>& window : windows) {
      for (std::size_t k = 0; k + 1 < window.size(); k += 2) {
        first.push_back(window[k]);
        second.push_back(window[k + 1]);
      }
      if (window.size() % 2 == 1) single.push_back(window.back());
    }
    AffineMap base = selected(from.map, second), rest = selected(from.map, single);
    const AffineMap difference = sum_of(selected(from.map, first), base, -1);
    const AffineMap rectified = relu(node, difference, from.name, {&base, &rest});
    const AffineMap larger = sum_of(rectified, base, 1);
    from.map = stacked({&larger, &rest});
    from.name.clear();
    int pair = 0, alone = larger.outputs();
    for (std::vector<int>& window : windows) {
      std::vector<int> next;
      for (std::size_t k = 0; k + 1 < window.size(); k += 2) next.push_back(pair++);
      if (window.size() % 2 == 1) next.push_back(alone++);
      window = std::move(next);
    }
  }
  std::vector<int> which;
  for (const std::vector<int>& window : windows) which.push_back(window.front());
  return {selected(from.map, which), std::move(shape), from.name};
}

OnnxValue OnnxGraph::largest_of_inputs(const Node& node) {
  const bool is_least = node.type == "Min";
  const OnnxValue* first = nullptr;
  for (std::size_t k = 0; k < node.inputs.size() && first == nullptr; ++k)
    if (is_value(node, k)) first = &value(node, k);
  if (first == nullptr) throw OperatorRefusal{"does not use the output of the preceding node"};
  const OnnxShape shape = first->shape;
  const auto size = static_cast<int>(count_of(shape));
  std::vector<AffineMap> parts;
  for (std::size_t k = 0; k < node.inputs.size(); ++k) {
    AffineMap part;
    if (is_value(node, k)) {
      if (value(node, k).shape != shape) throw OperatorRefusal{"its inputs are of different shapes"};
      part = value(node, k).map;
    } else {
      part.inputs = chain_.width();
      part.rows.resize(static_cast<std::size_t>(size));
      part.shift = broadcast(needed_constant(node, k), shape);
    }
    parts.push_back(is_least ? scaled(std::move(part), -1) : std::move(part));
  }
  std::vector<const AffineMap*> pointers;
  for (const AffineMap& part : parts) pointers.push_back(&part);
  std::vector<std::vector<int>> windows(static_cast<std::size_t>(size));
  for (int i = 0; i < size; ++i)
    for (int k = 0; k < static_cast<int>(parts.size()); ++k)
      windows[static_cast<std::size_t>(i)].push_back(k * size + i);
  OnnxValue result = largest(node, {stacked(pointers), shape, first->name}, std::move(windows), shape);
  if (is_least) scale_rows(result.map, {{-1, 0}});
  return result;
}

/// Returns whether the node only computes a constant; if so, stores it.
bool OnnxGraph::follow_constant(const Node& node) {
  const auto is_stored = [this](const std::string& name) {
    return name.empty() || model_.tensors.count(name) == 1;
  };
  const bool all_stored = std::all_of(node.inputs.begin(), node.inputs.end(), is_stored);
  const bool is_shape = node.type == "Shape" && node.inputs.size() == 1 && is_value(node, 0);
  if (node.type != "Constant" && !is_shape && (!all_stored || node.inputs.empty() || node.inputs[0].empty()))
    return false;
  compute_constant(node);
  for (const std::string& name : node.inputs)
    if (--uses_[name] == 0) values_.erase(name);
  return true;
}

void OnnxGraph::compute_constant(const Node& node) {
  OnnxTensor result;
  const OnnxTensor* const first = node.type == "Shape" ? nullptr : constant(node, 0);
  if (first != nullptr) result = *first;
  if (node.type == "Constant") {
    result = *node.attributes.at("value").tensor;  // the reader of the file states it here
  } else if (node.type == "Shape") {
    OnnxShape shape;
    if (is_value(node, 0)) {
      shape = value(node, 0).shape;
    } else {
      const OnnxTensor& stored = needed_constant(node, 0);
      shape.assign(stored.shape.begin(), stored.shape.end());
    }
    result.integers = stated_sizes(node, shape);
    result.type = kOnnxInt64;
    result.is_read = true;
    result.shape = {result.integers.size()};
  } else if (node.type == "Reshape" || node.type == "Squeeze" || node.type == "Unsqueeze" ||
             node.type == "Flatten") {
    const OnnxShape own(result.shape.begin(), result.shape.end());
    if (node.type == "Reshape" && !result.numbers.empty()) {
      const bool zero_is_zero = node.number("allowzero", 0) != 0;
      const OnnxShape shape = reshaped(own, integers(node, 1, "shape"), zero_is_zero);
      result.shape.assign(shape.begin(), shape.end());
    } else if (result.integers.empty()) {
      throw OperatorRefusal{"cannot be computed from constants",
                            "fold constants: torch.onnx.export(..., do_constant_folding=True)"};
    }  // lists of sizes remain lists of integers, whatever the axes
    for (const char* const attribute : {"axes", "axis", "allowzero"}) node.read.insert(attribute);
  } else if (node.type == "Transpose" && !result.numbers.empty()) {
    OnnxShape shape;
    const OnnxShape own(result.shape.begin(), result.shape.end());
    const std::vector<int> which = transposition(own, node.integers("perm", {}), shape);
    std::vector<double> numbers;
    for (const int k : which) numbers.push_back(result.numbers[static_cast<std::size_t>(k)]);
    result.numbers = std::move(numbers);
    result.shape.assign(shape.begin(), shape.end());
  } else if (node.type == "Gather" && !result.integers.empty() && node.number("axis", 0) == 0) {
    const std::vector<std::int64_t> sizes = result.integers;
    result.integers.clear();
    for (const std::int64_t index : needed_constant(node, 1).integers)
      result.integers.push_back(sizes[axis_of(index, sizes.size())]);
    result.shape = {result.integers.size()};
  } else if (node.type == "Concat" && !result.integers.empty() && node.number("axis", 0) == 0) {
    result.integers.clear();
    for (std::size_t k = 0; k < node.inputs.size(); ++k) {
      const std::vector<std::int64_t>& more = needed_constant(node, k).integers;
      result.integers.insert(result.integers.end(), more.begin(), more.end());
      if (result.integers.size() > 64) throw OperatorRefusal{"its result has too many entries"};
    }
    result.shape = {result.integers.size()};
  } else if (node.type == "Cast") {
    require_exact_cast(node, result.numbers);
  } else if (node.type != "Identity") {
    throw OperatorRefusal{
        "does not use the output of the preceding node; constants are not computed with this operator",
        "fold constants: torch.onnx.export(..., do_constant_folding=True)"};
  }
  result.offset = node.offset;
  const std::string name = node.outputs[0];
  result.name = first != nullptr && !first->name.empty() ? first->name : name;
  if (node.type == "Constant" || node.type == "Identity") result.name = name;
  if (values_.count(name) == 1 || !model_.tensors.emplace(name, std::move(result)).second)
    refuse(node.offset, in_quotes(name), "appears twice");
}

}  // namespace swarmcert::files
