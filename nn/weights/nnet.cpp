#include "nn/weights/nnet.h"

#include <charconv>
#include <cmath>
#include <string_view>

#include "nn/base/input_error.h"
#include "nn/weights/affine_map.h"
#include "nn/weights/layer_order.h"
#include "nn/weights/relu_chain.h"
#include "nn/weights/tensors.h"

namespace swarmcert::files {
namespace {

constexpr double kMostLayers = 4096, kMostWidth = 1 << 20;

class NnetReader {
 public:
  NnetReader(const std::string& bytes, const std::string& path) : rest_(bytes), path_(path) {}

  std::vector<Layer> run() {
    const std::vector<double> counts = numbers(4);
    const auto layers = static_cast<std::size_t>(count(counts[0], kMostLayers));
    const auto inputs = static_cast<std::size_t>(count(counts[1], kMostWidth));
    const auto outputs = static_cast<std::size_t>(count(counts[2], kMostWidth));
    std::vector<std::size_t> widths;
    for (const double width : numbers(layers + 1))
      widths.push_back(static_cast<std::size_t>(count(width, kMostWidth)));
    if (widths.front() != inputs || widths.back() != outputs)
      refuse("the sizes of its layers are inconsistent");
    next_line();  // an obsolete flag
    next_line();  // minimum inputs
    next_line();  // maximum inputs
    const std::vector<double> means = numbers(inputs + 1), ranges = numbers(inputs + 1);
    for (const double range : ranges)
      if (range == 0) refuse("a range is 0");
    ReluChain chain(static_cast<int>(inputs));
    AffineMap current = normalization(means, ranges);
    std::uint64_t elements = 0;
    for (std::size_t k = 0; k < layers; ++k) {
      elements += static_cast<std::uint64_t>(widths[k]) * widths[k + 1];
      if (elements > kMostElements) refuse("the network has more than 2^25 numbers");
      current = composed(layer(widths[k], widths[k + 1]), current);
      const std::string name = "layer" + std::to_string(k + 1);
      if (k + 1 < layers) current = chain.relu(current, {}, name);
    }
    scale_rows(current, {{ranges.back(), 0}});
    shift_rows(current, {{means.back(), 0}}, 1);
    if (!current.is_finite()) refuse("its numbers exceed the range of double");
    return chain.finished(current, "layer" + std::to_string(layers));
  }

 private:
  [[noreturn]] void refuse(const std::string& what) const {
    throw InputError(
        {path_, "line " + std::to_string(line_), "", "", what,
         "the format: numLayers,inputSize,outputSize,maxLayerSize; the sizes; a flag; minimum and maximum "
         "inputs; means; ranges; then weights and biases, one neuron per line"});
  }

  double count(double number, double most) const {
    if (!(number >= 1 && number <= most) || number != std::floor(number)) refuse("expected a count");
    return number;
  }

  /// Returns the next line that is not a comment.
  std::string_view next_line() {
    for (;;) {
      if (rest_.empty()) refuse("the file ends early");
      const std::size_t end = std::min(rest_.find('\n'), rest_.size());
      std::string_view line = rest_.substr(0, end);
      rest_.remove_prefix(std::min(end + 1, rest_.size()));
      ++line_;
      while (!line.empty() && (line.back() == '\r' || line.back() == ' ' || line.back() == ','))
        line.remove_suffix(1);
      if (line.substr(0, 2) != "//" && !line.empty()) return line;
    }
  }

  std::vector<double> numbers(std::size_t wanted) {
    std::string_view line = next_line();
    std::vector<double> result;
    while (!line.empty()) {
      while (!line.empty() && (line[0] == ' ' || line[0] == ',' || line[0] == '\t')) line.remove_prefix(1);
      if (!line.empty() && line[0] == '+') line.remove_prefix(1);
      double number = 0;
      const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), number);
      if (error != std::errc() || !std::isfinite(number)) refuse("expected a finite number");
      line.remove_prefix(static_cast<std::size_t>(end - line.data()));
      if (!line.empty() && line[0] != ',' && line[0] != ' ' && line[0] != '\t') refuse("expected a comma");
      result.push_back(number);
      if (result.size() > wanted) break;
    }
    if (result.size() != wanted) refuse("expected " + std::to_string(wanted) + " numbers");
    return result;
  }

  static AffineMap normalization(const std::vector<double>& means, const std::vector<double>& ranges) {
    AffineMap map = identity_map(static_cast<int>(means.size() - 1));
    for (std::size_t i = 0; i < map.rows.size(); ++i) {
      map.rows[i][0].factor = divided({1, 0}, {ranges[i], 0});
      map.shift[i] = divided({-means[i], 0}, {ranges[i], 0});
    }
    return map;
  }

  AffineMap layer(std::size_t inputs, std::size_t outputs) {
    AffineMap map;
    map.inputs = static_cast<int>(inputs);
    for (std::size_t i = 0; i < outputs; ++i) {
      AffineMap::Row row;
      const std::vector<double> weights = numbers(inputs);
      for (std::size_t j = 0; j < inputs; ++j)
        if (weights[j] != 0) row.push_back({static_cast<int>(j), {weights[j], 0}});
      map.rows.push_back(std::move(row));
    }
    for (std::size_t i = 0; i < outputs; ++i) map.shift.push_back({numbers(1)[0], 0});
    return map;
  }

  std::string_view rest_;
  const std::string& path_;
  std::size_t line_ = 0;
};

}  // namespace

bool looks_like_nnet(const std::string& bytes) {
  std::string_view rest(bytes);
  while (rest.substr(0, 2) == "//" || rest.substr(0, 1) == "\n" || rest.substr(0, 1) == "\r")
    rest.remove_prefix(std::min(rest.find('\n'), rest.size() - 1) + 1);
  int counts = 0;
  bool in_number = false;
  for (const char c : rest.substr(0, std::min(rest.find('\n'), rest.size()))) {
    const bool is_digit = c >= '0' && c <= '9';
    if (!is_digit && c != ',' && c != ' ' && c != '\r') return false;
    if (is_digit && !in_number) ++counts;
    in_number = is_digit;
  }
  return counts == 4;
}

Weights parse_nnet(const std::string& bytes, const std::string& path, const std::vector<std::string>& order) {
  Weights weights;
  weights.path = path;
  weights.precision = Precision::kFloat64;
  try {
    weights.layers = NnetReader(bytes, path).run();
  } catch (const FoldingLimit& limit) {
    throw InputError({path, "", "", "", limit.what, "certify a smaller network"});
  }
  weights.notes = {"the normalization of inputs and outputs is folded into the first and the last layer",
                   "the clamp of inputs to their minimum and maximum values is omitted"};
  weights.order_source = stated_order(weights.layers, order, path);
  return weights;
}

}  // namespace swarmcert::files
