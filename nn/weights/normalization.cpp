#include "nn/weights/normalization.h"

#include <stdexcept>
#include <utility>

#include "nn/base/input_error.h"
#include "nn/weights/relu_chain.h"

namespace swarmcert::files {
namespace {

/// Replaces the numbers of `layer` by those of `map`, which has the same outputs.
void set_map(Layer& layer, const AffineMap& map) {
  Layer folded = ReluChain(map.inputs).finished(map, layer.name).front();
  folded.activation = layer.activation;
  folded.kept = layer.kept;
  folded.is_added = layer.is_added;
  layer = std::move(folded);
}

/// Returns the first layer of x -> f((x - m) ./ r).
AffineMap normalized_first(const Weights& weights, const std::vector<Enclosed>& means,
                           const std::vector<Enclosed>& ranges) {
  AffineMap normalization = identity_map(weights.inputs());
  for (std::size_t i = 0; i < normalization.rows.size(); ++i) {
    normalization.rows[i][0].factor = divided({1, 0}, ranges[i]);
    normalization.shift[i] = divided({-means[i].value, means[i].radius}, ranges[i]);
  }
  return composed(map_of(weights.layers.front()), normalization);
}

void require_finite(const AffineMap& map, const std::string& path) {
  if (!map.is_finite())
    throw InputError({path, "", "normalization", "", "its numbers exceed the range of double", ""});
}

}  // namespace

Weights with_normalized_inputs(Weights weights, const std::vector<Enclosed>& means,
                               const std::vector<Enclosed>& ranges) {
  const Layer& first = weights.layers.front();
  if (first.weight_rounding > 0 || first.bias_rounding > 0)
    throw InputError(
        {weights.path, "", "normalization", "",
         "cannot be folded into the layer " + in_quotes(first.name) + ", whose weights were rounded",
         "export the network with its effective weights"});
  if (weights.stored.empty()) weights.stored = weights.layers;
  const AffineMap map = normalized_first(weights, means, ranges);
  require_finite(map, weights.path);
  set_map(weights.layers.front(), map);
  if (weights.precision == Precision::kFloat32) weights.precision = least_precision(weights.layers);
  return weights;
}

Weights normalized(Weights weights, const std::vector<double>& means, const std::vector<double>& ranges) {
  const auto inputs = static_cast<std::size_t>(weights.inputs());
  if (means.size() != inputs + 1 || ranges.size() != inputs + 1)
    throw std::invalid_argument("normalized: needs a mean and a range per input and one for the outputs");
  std::vector<Enclosed> exact_means, exact_ranges;
  for (std::size_t i = 0; i <= inputs; ++i) {
    if (ranges[i] == 0)
      throw InputError({weights.path, "", "normalization", "", "a range is 0", "save the file again"});
    exact_means.push_back({means[i], 0});
    exact_ranges.push_back({ranges[i], 0});
  }
  if (weights.stored.empty()) weights.stored = weights.layers;
  const AffineMap first = normalized_first(weights, exact_means, exact_ranges);
  const bool is_only = weights.layers.size() == 1;
  AffineMap last = is_only ? first : map_of(weights.layers.back());
  scale_rows(last, {exact_ranges.back()});
  shift_rows(last, {exact_means.back()}, 1);
  require_finite(first, weights.path);
  require_finite(last, weights.path);
  if (!is_only) set_map(weights.layers.front(), first);
  set_map(weights.layers.back(), last);
  if (weights.precision == Precision::kFloat32) weights.precision = least_precision(weights.layers);
  weights.notes.emplace_back(
      "the normalization of inputs and outputs is folded into the first and the last layer");
  return weights;
}

}  // namespace swarmcert::files
