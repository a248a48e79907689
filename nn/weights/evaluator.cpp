#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "nn/base/input_error.h"
#include "nn/weights/weights.h"

namespace swarmcert::files {
namespace {

template <typename Scalar>
std::vector<Scalar> converted(const std::vector<double>& values, const std::string& path,
                              const std::string& field) {
  // The smallest double that does not round to a finite float: halfway between the largest float and 2^128.
  constexpr bool kIsNarrow = sizeof(Scalar) < sizeof(double);
  constexpr double kOverflow = kIsNarrow ? 0x1.ffffffp127 : std::numeric_limits<double>::infinity();
  std::vector<Scalar> result;
  result.reserve(values.size());
  for (const double value : values) {
    if (!(std::abs(value) < kOverflow)) {
      throw InputError({path, "", field, std::to_string(value),
                        kIsNarrow ? "is beyond the range of float32" : "is not finite",
                        "evaluate this network in float64"});
    }
    result.push_back(static_cast<Scalar>(value));
  }
  return result;
}

}  // namespace

Weights as_float32(Weights weights) {
  for (Layer& layer : weights.layers) {
    const auto weight = converted<float>(layer.weights, weights.path, layer.name + ".weight");
    const auto bias = converted<float>(layer.biases, weights.path, layer.name + ".bias");
    layer.weights.assign(weight.begin(), weight.end());
    layer.biases.assign(bias.begin(), bias.end());
    layer.weight_rounding = layer.bias_rounding = 0;  // the float32 numbers are now the exact network
  }
  weights.precision = Precision::kFloat32;
  return weights;
}

template <typename Scalar>
Evaluator<Scalar>::Evaluator(const Weights& weights)
    : is_relu_(weights.is_relu()), activations_(weights.activations()) {
  if (sizeof(Scalar) < sizeof(double) && !is_relu_)
    throw InputError({weights.path, "", "activation", weights.activation_names(),
                      "float32 evaluates ReLU networks only", "evaluate this network in float64"});
  for (const Layer& layer : weights.layers) kept_.push_back(layer.kept);
  arrays_.reserve(2 * weights.layers.size());
  for (const Layer& layer : weights.layers) {
    arrays_.push_back(converted<Scalar>(layer.weights, weights.path, layer.name + ".weight"));
    const Scalar* const w = arrays_.back().data();
    arrays_.push_back(converted<Scalar>(layer.biases, weights.path, layer.name + ".bias"));
    layers_.push_back({w, arrays_.back().data(), layer.outputs, layer.inputs});
  }
}

template <typename Scalar>
nn::Mlp<Scalar> Evaluator<Scalar>::mlp() const {
  if (!is_relu_) throw std::logic_error("Evaluator: this is not a ReLU network");
  return {layers_.data(), static_cast<int>(layers_.size())};
}

/// Evaluates layer by layer, for any activations.
template <typename Scalar>
std::vector<Scalar> Evaluator<Scalar>::smooth_value(const std::vector<Scalar>& input) const {
  std::vector<Scalar> x = input;
  for (std::size_t k = 0; k < layers_.size(); ++k) {
    std::vector<Scalar> y(static_cast<std::size_t>(layers_[k].outputs));
    nn::apply<1>(layers_[k], x.data(), y.data(), nn::Activation::kNone);
    if (k < activations_.size()) {
      const std::vector<double> after = activated(activations_[k], {y.begin(), y.end() - kept_[k]});
      for (std::size_t i = 0; i < after.size(); ++i) y[i] = static_cast<Scalar>(after[i]);
    }
    x = std::move(y);
  }
  return x;
}

template <typename Scalar>
std::vector<Scalar> Evaluator<Scalar>::operator()(const std::vector<Scalar>& input) const {
  if (input.size() != static_cast<std::size_t>(layers_.front().inputs)) {
    throw std::invalid_argument("Evaluator: input has " + std::to_string(input.size()) +
                                " entries, the network has " + std::to_string(layers_.front().inputs) +
                                " inputs");
  }
  if (!is_relu_) return smooth_value(input);
  const nn::Mlp<Scalar> network = mlp();
  std::vector<Scalar> output(static_cast<std::size_t>(network.outputs()));
  std::vector<Scalar> scratch(static_cast<std::size_t>(nn::scratch_size(network)));
  nn::evaluate(network, input.data(), output.data(), scratch.data());
  return output;
}

template class Evaluator<float>;
template class Evaluator<double>;

}  // namespace swarmcert::files
