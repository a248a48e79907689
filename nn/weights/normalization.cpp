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

}  // namespace

Weights normalized(Weights weights, const std::vector<double>& means, const std::vector<double>& ranges) {
  const auto inputs = static_cast<std::size_t>(weights.inputs());
  if (means.size() != inputs + 1 || ranges.size() != inputs + 1)
    throw std::invalid_argument("normalized: needs a mean and a range per input and one for the outputs");
  for (const double range : ranges)
    if (range == 0)
      throw InputError({weights.path, "", "normalization", "", "a range is 0", "save the file again"});
  if (weights.stored.empty()) weights.stored = weights.layers;
  AffineMap normalization = identity_map(weights.inputs());
  for (std::size_t i = 0; i < inputs; ++i) {
    normalization.rows[i][0].factor = divided({1, 0}, {ranges[i], 0});
    normalization.shift[i] = divided({-means[i], 0}, {ranges[i], 0});
  }
  AffineMap first = composed(map_of(weights.layers.front()), normalization);
  const bool is_only = weights.layers.size() == 1;
  AffineMap last = is_only ? first : map_of(weights.layers.back());
  scale_rows(last, {{ranges.back(), 0}});
  shift_rows(last, {{means.back(), 0}}, 1);
  if (!first.is_finite() || !last.is_finite())
    throw InputError({weights.path, "", "normalization", "", "its numbers exceed the range of double", ""});
  if (!is_only) set_map(weights.layers.front(), first);
  set_map(weights.layers.back(), last);
  if (weights.precision == Precision::kFloat32) weights.precision = least_precision(weights.layers);
  weights.notes.emplace_back(
      "the normalization of inputs and outputs is folded into the first and the last layer");
  return weights;
}

}  // namespace swarmcert::files
