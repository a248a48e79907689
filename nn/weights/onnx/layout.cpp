// The operators of OnnxGraph that rearrange numbers without arithmetic: Pad, Cast, Flatten, Reshape, Squeeze,
// Transpose, Concat.
#include <algorithm>
#include <cmath>
#include <utility>

#include "nn/weights/onnx/graph.h"
#include "nn/weights/tensors.h"

namespace swarmcert::files {
namespace {

/// Returns the shape without, or with, dimensions of size one at `axes`, for Squeeze and Unsqueeze.
OnnxShape squeezed(const OnnxShape& from, const std::vector<std::int64_t>& axes, bool adds) {
  const std::size_t rank = adds ? from.size() + axes.size() : from.size();
  if (rank > 16) throw OperatorRefusal{"its result has too many dimensions"};
  std::set<std::size_t> named;
  for (const std::int64_t axis : axes) named.insert(axis_of(axis, rank));
  OnnxShape shape;
  std::size_t next = 0;
  for (std::size_t d = 0; d < rank; ++d) {
    const bool is_named = named.count(d) == 1 || (!adds && axes.empty() && from[d] == 1);
    if (adds) {
      shape.push_back(is_named ? 1 : from.at(std::min(next++, from.size() - 1)));
    } else if (!is_named) {
      shape.push_back(from[d]);
    }
  }
  if (count_of(shape) != count_of(from)) throw OperatorRefusal{"its axes do not fit its input"};
  return shape;
}

/// Returns the two-dimensional shape of Flatten: the dimensions before `axis`, and the remaining ones.
OnnxShape flattened(const OnnxShape& from, std::int64_t axis) {
  const std::size_t at =
      axis == static_cast<std::int64_t>(from.size()) ? from.size() : axis_of(axis, from.size());
  const OnnxShape front(from.begin(), from.begin() + static_cast<std::ptrdiff_t>(at));
  return {count_of(front), count_of(from) / count_of(front)};
}

std::int64_t integer_attribute(const OnnxNode& node, const char* attribute, std::int64_t otherwise) {
  const double number = node.number(attribute, static_cast<double>(otherwise));
  if (!(std::fabs(number) < 1e9)) throw OperatorRefusal{std::string(attribute) + " is out of range"};
  return static_cast<std::int64_t>(number);
}

void require_cast_to_float(const OnnxNode& node) {
  const std::int64_t to = integer_attribute(node, "to", 0);
  if (to != static_cast<std::int64_t>(kOnnxFloat) && to != static_cast<std::int64_t>(kOnnxDouble))
    throw OperatorRefusal{"casts to a type that is neither float32 nor float64"};
}

}  // namespace

/// Pads with a constant, which is 0 unless input 2 states another.
OnnxValue OnnxGraph::padded(const Node& node, const OnnxValue& x) const {
  const std::vector<std::int64_t> pads = integers(node, 1, "pads");
  const OnnxTensor* const filler = constant(node, 2);
  const OnnxTensor* const axes = constant(node, 3);
  const std::size_t rank = x.shape.size();
  for (std::size_t d = 0; axes != nullptr && d < rank; ++d)
    if (axes->integers.size() != rank || axis_of(axes->integers[d], rank) != d)
      throw OperatorRefusal{"its axes are not all axes of its input in order", "state pads for every axis"};
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

OnnxValue OnnxGraph::concatenated(const Node& node) const {
  const OnnxShape& first = value(node, 0).shape;
  const std::size_t axis = axis_of(integer_attribute(node, "axis", 0), first.size());
  std::int64_t before = 1, after = 1;
  for (std::size_t d = 0; d < axis; ++d) before *= first[d];
  for (std::size_t d = axis + 1; d < first.size(); ++d) after *= first[d];
  std::vector<const AffineMap*> maps;
  std::vector<int> offset, size;
  int rows = 0;
  std::uint64_t entries = 0;
  OnnxShape shape = first;
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
  return {selected(all, which), shape, value(node, 0).name};
}

OnnxValue OnnxGraph::computed_layout(const Node& node) {
  OnnxValue result = value(node, 0);
  if (node.type == "Pad") return padded(node, result);
  if (node.type == "Concat") return concatenated(node);
  if (node.type == "Dropout") {
    require_inference(node);
  } else if (node.type == "Cast") {
    require_cast_to_float(node);
  } else if (node.type == "Flatten") {
    result.shape = flattened(result.shape, integer_attribute(node, "axis", 1));
  } else if (node.type == "Reshape") {
    result.shape =
        reshaped(result.shape, integers(node, 1, "shape"), integer_attribute(node, "allowzero", 0) != 0);
  } else if (node.type == "Squeeze" || node.type == "Unsqueeze") {
    result.shape = squeezed(result.shape, integers(node, 1, "axes"), node.type == "Unsqueeze");
  } else if (node.type == "Transpose") {
    OnnxShape shape;
    result.map = selected(result.map, transposition(result.shape, node.integers("perm", {}), shape));
    result.shape = shape;
  }
  return result;
}

}  // namespace swarmcert::files
