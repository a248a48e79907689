#include "nn/weights/onnx/operators.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include "nn/weights/tensors.h"

namespace swarmcert::files {
namespace {

OnnxShape signed_shape(const OnnxTensor& tensor) { return {tensor.shape.begin(), tensor.shape.end()}; }

void require_numbers(const OnnxTensor& tensor) {
  if (!tensor.is_read || (tensor.numbers.empty() && !tensor.integers.empty()))
    throw OperatorRefusal{"its constant has data type " + std::to_string(tensor.type) +
                              ", but weights must be float16, bfloat16, float32 or float64",
                          "convert before exporting: model.float()"};
}

/// Limit on the entries of the map of a convolution or pooling, which can be far larger than the file.
constexpr std::uint64_t kMostWindowEntries = std::uint64_t{1} << 23;

/// Counts and limits the entries of a map as it is built.
class MapBuilder {
 public:
  MapBuilder(std::int64_t inputs, std::int64_t outputs) {
    if (inputs > static_cast<std::int64_t>(kMostElements) || outputs > static_cast<std::int64_t>(kMostRows))
      throw FoldingLimit{"as a dense layer it has too many numbers"};
    map.inputs = static_cast<int>(inputs);
    map.rows.resize(static_cast<std::size_t>(outputs));
    map.shift.resize(static_cast<std::size_t>(outputs));
  }
  void add(std::int64_t row, std::int64_t column, const Enclosed& factor) {
    if (factor.value == 0 && factor.radius == 0) return;
    if (++entries_ > kMostElements) throw FoldingLimit{"the folded layer has more than 2^25 numbers"};
    map.rows[static_cast<std::size_t>(row)].push_back({static_cast<int>(column), factor});
  }
  AffineMap map;

 private:
  std::uint64_t entries_ = 0;
};

void add_shift(AffineMap& map, const OnnxTensor& bias, double factor, std::int64_t per_entry) {
  require_numbers(bias);
  const std::size_t rows = map.rows.size(), repeats = static_cast<std::size_t>(per_entry);
  if (bias.numbers.size() != 1 && bias.numbers.size() * repeats != rows)
    throw OperatorRefusal{"its bias of shape " + shape_text(bias.shape) + " does not fit"};
  for (std::size_t i = 0; i < rows; ++i) {
    const double number = bias.numbers[bias.numbers.size() == 1 ? 0 : i / repeats];
    map.shift[i] = times({factor, 0}, {number, 0});
  }
}

/// Positions of a sliding window and the entries that it covers, along all its axes.
class Window {
 public:
  Window(const OnnxNode& node, const OnnxShape& shape, const OnnxShape& kernel) : kernel_(kernel) {
    const std::size_t axes = kernel.size();
    if (axes == 0 || shape.size() != axes + 2 || shape[0] != 1)
      throw OperatorRefusal{"its input must have the shape [1, channels, sizes...]"};
    in_.assign(shape.begin() + 2, shape.end());
    stride_ = positive(node, "strides", axes);
    dilation_ = positive(node, "dilations", axes);
    if (node.number("ceil_mode", 0) != 0) throw OperatorRefusal{"ceil_mode is not 0"};
    pad(node);
    for (std::size_t a = 0; a < axes; ++a) {
      const std::int64_t reach = (kernel_[a] - 1) * dilation_[a] + 1;
      const std::int64_t room = in_[a] + before_[a] + after_[a] - reach;
      if (room < 0) throw OperatorRefusal{"its window is larger than its input"};
      out.push_back(room / stride_[a] + 1);
    }
  }

  std::int64_t inputs() const { return count_of(in_); }
  std::int64_t places() const { return count_of(out); }
  std::int64_t size() const { return count_of(kernel_); }

  /// Returns the entry that element `k` of the window covers at `place`, or -1 if it is in the padding.
  std::int64_t covered(std::int64_t place, std::int64_t k) const {
    std::int64_t index = 0, factor = 1;
    for (std::size_t a = in_.size(); a-- > 0;) {
      const std::int64_t at = place % out[a] * stride_[a] + k % kernel_[a] * dilation_[a] - before_[a];
      if (at < 0 || at >= in_[a]) return -1;
      index += at * factor;
      factor *= in_[a];
      place /= out[a];
      k /= kernel_[a];
    }
    return index;
  }

  OnnxShape out;

 private:
  static constexpr std::int64_t kMostStep = 1 << 20;

  static OnnxShape positive(const OnnxNode& node, const char* name, std::size_t axes) {
    const OnnxShape sizes = node.integers(name, OnnxShape(axes, 1));
    const bool fits = sizes.size() == axes && std::all_of(sizes.begin(), sizes.end(), [](std::int64_t size) {
                        return size >= 1 && size <= kMostStep;
                      });
    if (!fits) throw OperatorRefusal{std::string(name) + " does not fit its window"};
    return sizes;
  }

  void pad(const OnnxNode& node) {
    const std::size_t axes = in_.size();
    const std::string mode = node.text("auto_pad", "NOTSET");
    const OnnxShape pads = node.integers("pads", OnnxShape(2 * axes, 0));
    if (mode == "NOTSET" && pads.size() != 2 * axes) throw OperatorRefusal{"pads does not fit its window"};
    for (std::size_t a = 0; a < axes; ++a) {
      std::int64_t before = 0, after = 0;
      if (mode == "NOTSET") {
        before = pads[a];
        after = pads[axes + a];
      } else if (mode == "SAME_UPPER" || mode == "SAME_LOWER") {
        const std::int64_t places = (in_[a] + stride_[a] - 1) / stride_[a];
        const std::int64_t reach = (kernel_[a] - 1) * dilation_[a] + 1;
        const std::int64_t total = std::max<std::int64_t>(0, (places - 1) * stride_[a] + reach - in_[a]);
        before = mode == "SAME_UPPER" ? total / 2 : total - total / 2;
        after = total - before;
      } else if (mode != "VALID") {
        throw OperatorRefusal{"auto_pad is unknown"};
      }
      if (before < 0 || after < 0 || before > kMostStep || after > kMostStep)
        throw OperatorRefusal{"pads does not fit its window"};
      before_.push_back(before);
      after_.push_back(after);
    }
  }

  OnnxShape in_, kernel_, stride_, dilation_, before_, after_;
};

void limit_work(std::int64_t a, std::int64_t b, std::int64_t c) {
  const auto count = element_count(
      {static_cast<std::uint64_t>(a), static_cast<std::uint64_t>(b), static_cast<std::uint64_t>(c)});
  if (!count || *count > kMostWindowEntries) throw FoldingLimit{"as a dense layer it has too many numbers"};
}

/// Returns the window of a pooling node; for a global one it covers the whole input.
Window pooling_window(const OnnxNode& node, const OnnxShape& shape) {
  if (shape.size() < 3) throw OperatorRefusal{"its input must have the shape [1, channels, sizes...]"};
  if (node.type.rfind("Global", 0) == 0) return {node, shape, OnnxShape(shape.begin() + 2, shape.end())};
  const OnnxShape kernel = node.integers("kernel_shape", {});
  const bool fits = std::all_of(kernel.begin(), kernel.end(),
                                [](std::int64_t size) { return size >= 1 && size <= 1 << 20; });
  if (!fits || !element_count({kernel.begin(), kernel.end()}))
    throw OperatorRefusal{"kernel_shape does not fit"};
  return {node, shape, kernel};
}

OnnxShape pooled(const OnnxShape& shape, const Window& window) {
  OnnxShape result = {1, shape[1]};
  result.insert(result.end(), window.out.begin(), window.out.end());
  return result;
}

void set_rows(MapBuilder& builder, const OnnxTensor& weight, bool outputs_first, const Enclosed& factor) {
  const auto inputs = static_cast<std::int64_t>(weight.shape[outputs_first ? 1 : 0]);
  const auto outputs = static_cast<std::int64_t>(weight.shape[outputs_first ? 0 : 1]);
  for (std::int64_t i = 0; i < outputs; ++i) {
    builder.map.rows[static_cast<std::size_t>(i)].reserve(static_cast<std::size_t>(inputs));
    for (std::int64_t j = 0; j < inputs; ++j) {
      const std::int64_t at = outputs_first ? i * inputs + j : j * outputs + i;
      const Enclosed number{weight.numbers[static_cast<std::size_t>(at)], 0};
      builder.add(i, j, factor.value == 1 ? number : times(factor, number));
    }
  }
}

void require_row(const OnnxShape& shape, std::size_t axis, std::int64_t inputs) {
  if (!shape.empty() && shape[axis] == inputs && count_of(shape) == inputs) return;
  const std::string got = "takes " + std::to_string(inputs) + " inputs, but gets the shape " +
                          shape_text({shape.begin(), shape.end()});
  if (shape.size() == 2 && shape[axis] == inputs)
    throw OperatorRefusal{got + ", a batch of several",
                          "export with a batch of one, or of open size: torch.onnx.export(..., "
                          "dynamic_axes={\"x\": {0: \"batch\"}})"};
  throw OperatorRefusal{got};
}

void require_matrix(const OnnxTensor& weight) {
  require_numbers(weight);
  if (weight.shape.size() != 2 || weight.numbers.empty())
    throw OperatorRefusal{"its weights of shape " + shape_text(weight.shape) +
                          " must have two dimensions, neither of size 0"};
}

}  // namespace

std::int64_t count_of(const OnnxShape& shape) {
  return std::accumulate(shape.begin(), shape.end(), std::int64_t{1}, std::multiplies<>());
}

std::size_t axis_of(std::int64_t axis, std::size_t rank) {
  const std::int64_t counted = axis < 0 ? axis + static_cast<std::int64_t>(rank) : axis;
  if (counted < 0 || counted >= static_cast<std::int64_t>(rank))
    throw OperatorRefusal{"axis " + std::to_string(axis) + " does not exist"};
  return static_cast<std::size_t>(counted);
}

std::vector<Enclosed> broadcast(const OnnxTensor& tensor, const OnnxShape& shape) {
  require_numbers(tensor);
  OnnxShape own = signed_shape(tensor);
  while (own.size() > shape.size() && own.front() == 1) own.erase(own.begin());
  if (own.size() > shape.size())
    throw OperatorRefusal{"its constant of shape " + shape_text(tensor.shape) + " does not fit its input"};
  own.insert(own.begin(), shape.size() - own.size(), 1);
  for (std::size_t d = 0; d < shape.size(); ++d)
    if (own[d] != 1 && own[d] != shape[d])
      throw OperatorRefusal{"its constant of shape " + shape_text(tensor.shape) + " does not fit its input"};
  std::vector<Enclosed> numbers;
  const std::int64_t count = count_of(shape);
  for (std::int64_t i = 0; i < count; ++i) {
    std::int64_t rest = i, index = 0, factor = 1;
    for (std::size_t d = shape.size(); d-- > 0;) {
      if (own[d] != 1) index += rest % shape[d] * factor;
      factor *= own[d];
      rest /= shape[d];
    }
    numbers.push_back({tensor.numbers[static_cast<std::size_t>(index)], 0});
  }
  return numbers;
}

OnnxShape reshaped(const OnnxShape& shape, const std::vector<std::int64_t>& wanted, bool zero_is_zero) {
  OnnxShape result;
  std::int64_t known = 1;
  std::size_t open = wanted.size();
  const std::int64_t count = count_of(shape);
  for (std::size_t d = 0; d < wanted.size(); ++d) {
    std::int64_t size = wanted[d];
    if (size == 0 && !zero_is_zero && d < shape.size()) size = shape[d];
    if (size == -1 && open == wanted.size()) {
      open = d;
      size = 1;
    }
    if (size < 1 || size > count) throw OperatorRefusal{"its shape does not fit its input"};
    known *= size;
    if (known > count) throw OperatorRefusal{"its shape does not fit its input"};
    result.push_back(size);
  }
  if (open < wanted.size() && count % known == 0) {
    result[open] = count / known;
    known = count;
  }
  if (known != count) throw OperatorRefusal{"its shape does not fit its input"};
  return result;
}

std::vector<int> transposition(const OnnxShape& shape, const std::vector<std::int64_t>& permutation,
                               OnnxShape& result) {
  const std::size_t rank = shape.size();
  std::vector<bool> seen(rank, false);
  std::vector<std::size_t> from;
  for (std::size_t d = 0; d < rank; ++d) {
    const std::size_t axis = permutation.empty()          ? rank - 1 - d
                             : permutation.size() == rank ? axis_of(permutation[d], rank)
                                                          : rank;
    if (axis >= rank || seen[axis]) throw OperatorRefusal{"perm is not a permutation of its axes"};
    seen[axis] = true;
    from.push_back(axis);
  }
  result.clear();
  for (const std::size_t axis : from) result.push_back(shape[axis]);
  std::vector<std::int64_t> stride(rank, 1);
  for (std::size_t d = rank; d-- > 1;) stride[d - 1] = stride[d] * shape[d];
  std::vector<int> which;
  const std::int64_t count = count_of(shape);
  for (std::int64_t i = 0; i < count; ++i) {
    std::int64_t rest = i, index = 0;
    for (std::size_t d = rank; d-- > 0;) {
      index += rest % result[d] * stride[from[d]];
      rest /= result[d];
    }
    which.push_back(static_cast<int>(index));
  }
  return which;
}

AffineMap gemm_map(const OnnxNode& node, const OnnxTensor& weight, const OnnxTensor* bias,
                   const OnnxShape& shape, OnnxShape& result) {
  require_matrix(weight);
  if (node.number("transA", 0) != 0) throw OperatorRefusal{"transposes its input"};
  const bool outputs_first = node.number("transB", 0) != 0;
  const auto inputs = static_cast<std::int64_t>(weight.shape[outputs_first ? 1 : 0]);
  const auto outputs = static_cast<std::int64_t>(weight.shape[outputs_first ? 0 : 1]);
  require_row(shape, shape.size() - 1, inputs);
  MapBuilder builder(inputs, outputs);
  set_rows(builder, weight, outputs_first, {node.number("alpha", 1), 0});
  if (bias != nullptr) add_shift(builder.map, *bias, node.number("beta", 1), 1);
  result = {1, outputs};
  return std::move(builder.map);
}

AffineMap matmul_map(const OnnxTensor& weight, bool weight_is_left, const OnnxShape& shape,
                     OnnxShape& result) {
  require_matrix(weight);
  const auto inputs = static_cast<std::int64_t>(weight.shape[weight_is_left ? 1 : 0]);
  const auto outputs = static_cast<std::int64_t>(weight.shape[weight_is_left ? 0 : 1]);
  const std::size_t rank = shape.size();
  const std::size_t axis = weight_is_left && rank >= 2 ? rank - 2 : rank - 1;
  require_row(shape, axis, inputs);
  MapBuilder builder(inputs, outputs);
  set_rows(builder, weight, weight_is_left, {1, 0});
  result = shape;
  result[axis] = outputs;
  return std::move(builder.map);
}

AffineMap convolution_map(const OnnxNode& node, const OnnxTensor& weight, const OnnxTensor* bias,
                          const OnnxShape& shape, OnnxShape& result) {
  require_numbers(weight);
  const OnnxShape sizes = signed_shape(weight);
  if (sizes.size() < 3 || weight.numbers.empty())
    throw OperatorRefusal{"its weights of shape " + shape_text(weight.shape) + " are not a kernel"};
  const OnnxShape kernel_sizes(sizes.begin() + 2, sizes.end());
  if (node.integers("kernel_shape", kernel_sizes) != kernel_sizes)
    throw OperatorRefusal{"kernel_shape is not the shape of its weights"};
  const Window window(node, shape, kernel_sizes);
  const double groups_stated = node.number("group", 1);
  const std::int64_t outputs = sizes[0], per_group = sizes[1];
  if (!(groups_stated >= 1 && groups_stated <= static_cast<double>(shape[1])))
    throw OperatorRefusal{"group does not fit its channels"};
  const auto groups = static_cast<std::int64_t>(groups_stated);
  if (shape[1] != per_group * groups || outputs % groups != 0)
    throw OperatorRefusal{"its weights of shape " + shape_text(weight.shape) + " do not fit its input"};
  const std::int64_t places = window.places(), kernel = window.size(), image = window.inputs();
  limit_work(outputs * places, per_group, kernel);
  MapBuilder builder(count_of(shape), outputs * places);
  for (std::int64_t o = 0; o < outputs; ++o) {
    const std::int64_t first = o / (outputs / groups) * per_group;
    for (std::int64_t place = 0; place < places; ++place)
      for (std::int64_t c = 0; c < per_group; ++c)
        for (std::int64_t k = 0; k < kernel; ++k) {
          const std::int64_t at = window.covered(place, k);
          const double number = weight.numbers[static_cast<std::size_t>((o * per_group + c) * kernel + k)];
          if (at >= 0) builder.add(o * places + place, (first + c) * image + at, {number, 0});
        }
  }
  if (bias != nullptr) add_shift(builder.map, *bias, 1, places);
  result = {1, outputs};
  result.insert(result.end(), window.out.begin(), window.out.end());
  return std::move(builder.map);
}

AffineMap average_map(const OnnxNode& node, const OnnxShape& shape, OnnxShape& result) {
  const Window window = pooling_window(node, shape);
  const std::int64_t places = window.places(), image = window.inputs(), size = window.size();
  limit_work(shape[1], places, size);
  const bool counts_padding = node.number("count_include_pad", 0) != 0;
  MapBuilder builder(count_of(shape), shape[1] * places);
  for (std::int64_t place = 0; place < places; ++place) {
    std::vector<std::int64_t> covered;
    for (std::int64_t k = 0; k < size; ++k)
      if (window.covered(place, k) >= 0) covered.push_back(window.covered(place, k));
    if (covered.empty()) throw OperatorRefusal{"its window lies entirely in the padding"};
    const auto count = static_cast<double>(counts_padding ? size : static_cast<std::int64_t>(covered.size()));
    const Enclosed share = divided({1, 0}, {count, 0});
    for (std::int64_t c = 0; c < shape[1]; ++c)
      for (const std::int64_t at : covered) builder.add(c * places + place, c * image + at, share);
  }
  result = pooled(shape, window);
  return std::move(builder.map);
}

std::vector<std::vector<int>> max_windows(const OnnxNode& node, const OnnxShape& shape, OnnxShape& result) {
  const Window window = pooling_window(node, shape);
  const std::int64_t places = window.places(), image = window.inputs(), size = window.size();
  limit_work(shape[1], places, size);
  std::vector<std::vector<int>> windows;
  for (std::int64_t c = 0; c < shape[1]; ++c) {
    for (std::int64_t place = 0; place < places; ++place) {
      windows.emplace_back();
      for (std::int64_t k = 0; k < size; ++k) {
        const std::int64_t at = window.covered(place, k);
        if (at >= 0) windows.back().push_back(static_cast<int>(c * image + at));
      }
      if (windows.back().empty()) throw OperatorRefusal{"its window lies entirely in the padding"};
    }
  }
  result = pooled(shape, window);
  return windows;
}

void batch_normalization(const OnnxNode& node, const std::vector<const OnnxTensor*>& parameters,
                         const OnnxShape& shape, std::vector<Enclosed>& factors,
                         std::vector<Enclosed>& amounts) {
  const std::int64_t channels = shape.size() > 1 ? shape[1] : 0;
  for (const OnnxTensor* tensor : parameters) {
    require_numbers(*tensor);
    if (tensor->numbers.size() != static_cast<std::size_t>(channels))
      throw OperatorRefusal{"its parameters do not fit its channels"};
  }
  // The attribute is a float32, and so is the standard's default value of 1e-5.
  const Enclosed epsilon{node.number("epsilon", static_cast<double>(1e-5F)), 0};
  factors.clear();
  amounts.clear();
  if (node.number("spatial", 1) == 0) throw OperatorRefusal{"spatial is 0, as before operator set 9"};
  const std::int64_t batch = shape.empty() ? 1 : shape[0];
  const std::int64_t repeats = count_of(shape) / std::max<std::int64_t>(channels * batch, 1);
  for (std::size_t c = 0; c < static_cast<std::size_t>(channels); ++c) {
    const auto parameter = [&](std::size_t p) { return Enclosed{parameters[p]->numbers[c], 0}; };
    ExactSum variance;
    variance.add(parameter(3));
    variance.add(epsilon);
    const Enclosed squared = variance.value();
    if (!(squared.value > squared.radius)) throw OperatorRefusal{"its variance is not positive"};
    const Enclosed factor = divided(parameter(0), square_root(squared));
    ExactSum amount;
    amount.add(parameter(1));
    amount.add_product({-factor.value, factor.radius}, parameter(2));
    factors.insert(factors.end(), static_cast<std::size_t>(repeats), factor);
    amounts.insert(amounts.end(), static_cast<std::size_t>(repeats), amount.value());
  }
  const std::vector<Enclosed> factors_of_one = factors, amounts_of_one = amounts;
  for (std::int64_t b = 1; b < batch; ++b) {  // the channels are the second axis, inside the batch
    factors.insert(factors.end(), factors_of_one.begin(), factors_of_one.end());
    amounts.insert(amounts.end(), amounts_of_one.begin(), amounts_of_one.end());
  }
}

}  // namespace swarmcert::files
