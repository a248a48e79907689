#include "nn/weights/nnet.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string_view>

#include "nn/base/input_error.h"
#include "nn/weights/layer_order.h"
#include "nn/weights/normalization.h"
#include "nn/weights/tensors.h"

namespace swarmcert::files {
namespace {

constexpr double kMostLayers = 4096, kMostWidth = 1 << 20;

class NnetReader {
 public:
  NnetReader(const std::string& bytes, const std::string& path) : rest_(bytes), path_(path) {}

  Weights run() {
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
    if (std::count(ranges.begin(), ranges.end(), 0.0) > 0) refuse("a range is 0");
    Weights weights;
    weights.path = path_;
    weights.precision = Precision::kFloat64;
    std::uint64_t elements = 0;
    for (std::size_t k = 0; k < layers; ++k) {
      elements += static_cast<std::uint64_t>(widths[k]) * widths[k + 1];
      if (elements > kMostElements) refuse("the network has more than 2^25 numbers");
      weights.layers.push_back(layer(widths[k], widths[k + 1]));
      weights.layers.back().name = "layer" + std::to_string(k + 1);
    }
    return normalized(std::move(weights), means, ranges);
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

  Layer layer(std::size_t inputs, std::size_t outputs) {
    Layer layer;
    layer.inputs = static_cast<int>(inputs);
    layer.outputs = static_cast<int>(outputs);
    for (std::size_t i = 0; i < outputs; ++i) {
      const std::vector<double> row = numbers(inputs);
      layer.weights.insert(layer.weights.end(), row.begin(), row.end());
    }
    for (std::size_t i = 0; i < outputs; ++i) layer.biases.push_back(numbers(1)[0]);
    return layer;
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

Weights parse_nnet(const std::string& bytes, const std::string& path, const LayerChoice& choice) {
  Weights weights = NnetReader(bytes, path).run();
  weights.unused = {
      "minimum and maximum inputs: the format's evaluators clamp inputs to them, the network does not"};
  weights.order_source = stated_order(weights.layers, choice, path);
  return weights;
}

}  // namespace swarmcert::files
