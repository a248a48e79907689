#include "stability/reach/network_values.h"

#include <stdexcept>

namespace swarmcert::stability {
namespace {

AffineForm activated(files::Activation activation, const AffineForm& x) {
  switch (activation) {
    case files::Activation::kRelu:
      return relu(x);
    case files::Activation::kSigmoid:
      return sigmoid(x);
    case files::Activation::kTanh:
      return AffineForm(2) * sigmoid(AffineForm(2) * x) - 1;
    default:
      throw std::invalid_argument("network_values: no forms of " + files::function_of(activation).words);
  }
}

}  // namespace

AffineVector network_values(const files::Weights& network, AffineVector x) {
  if (x.size() != static_cast<std::size_t>(network.inputs()))
    throw std::invalid_argument("network_values: " + std::to_string(x.size()) + " forms for " +
                                std::to_string(network.inputs()) + " inputs");
  const std::size_t outer = symbols(x);
  for (std::size_t k = 0; k < network.layers.size(); ++k) {
    const files::Layer& layer = network.layers[k];
    const bool is_last = k + 1 == network.layers.size();
    if (layer.weight_rounding > 0 || layer.bias_rounding > 0 || layer.kept > 0)
      throw std::invalid_argument("network_values: layer " + layer.name + " is not an exact layer as stored");
    AffineVector y;
    for (std::size_t i = 0; i < layer.biases.size(); ++i) {
      y.push_back(weighted_sum(layer.biases[i], &layer.weights[i * x.size()], x));
      if (!is_last) y[i] = activated(layer.activation, y[i]);
    }
    x = is_last ? std::move(y) : with_radii_as_symbols(std::move(y), symbols(x));
  }
  for (AffineForm& one : x) one = one.without_symbols_from(outer);
  return x;
}

}  // namespace swarmcert::stability
