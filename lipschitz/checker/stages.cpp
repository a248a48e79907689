#include "lipschitz/checker/stages.h"

#include <map>
#include <stdexcept>

#include "lipschitz/checker/lipschitz_lmi.h"
#include "nn/weights/functions.h"
#include "nn/weights/invariants.h"

namespace swarmcert::check {
namespace {

/// The columns of W of these inputs, each times its scale where there is one.
Matrix selected_columns(const Matrix& w, const std::vector<int>& inputs, const std::vector<double>& scale) {
  Matrix result(w.rows, static_cast<int>(inputs.size()));
  for (int j = 0; j < result.cols; ++j) {
    const int input = inputs[static_cast<std::size_t>(j)];
    for (int i = 0; i < w.rows; ++i)
      result(i, j) =
          scale.empty() ? w(i, input) : w(i, input) * Dyadic(scale[static_cast<std::size_t>(input)]);
  }
  return result;
}

/// W, times the Lipschitz constant of the map to what it sees.
Matrix of_invariants(Matrix w, const Dyadic& slope) {
  for (Dyadic& entry : w.entries) entry = entry * slope;
  return w;
}

/// What an activation is divided by, and g of BentChain for the quotient, whose slopes lie in [0, 1] or [1 - c, c].
struct Unit {
  Dyadic slope, bend;
};

Unit unit_of(const files::ActivationFunction& function) {
  if (function.sorts())
    throw std::domain_error(function.words + " acts on whole layers: it has no slopes of single numbers");
  if (function.is_monotone()) return {function.greatest_slope, {}};
  const Dyadic c = function.greatest_slope;
  if (function.least_slope != 1 - function.greatest_slope)
    throw std::logic_error(function.op + ": slopes that do not add up to 1");
  return {1.0, c * (c + -Dyadic(1.0))};
}

}  // namespace

std::vector<Matrix> stages(const files::Network& network, const std::string& function,
                           const std::string& block, const std::vector<double>& scale) {
  BentChain chain = bent_chain(network, function, block, scale);
  if (chain.is_bent())
    throw std::domain_error(function + " has activations that are not monotone: slopes are not in [0, b]");
  return std::move(chain.stages);
}

BentChain bent_chain(const files::Network& network, const std::string& function, const std::string& block,
                     const std::vector<double>& scale) {
  const std::map<std::string, const files::Weights*> parts = files::parts(network);
  const std::vector<std::string> names = files::networks_of(function);
  const std::vector<int> coordinates = files::block_coordinates(network, function, block);
  const int inputs = parts.at(names.front())->inputs();
  const bool maps = files::maps_to_invariants(network, function);
  if (maps && !scale.empty())
    throw std::invalid_argument(function + " takes states, whose invariants have no scale");
  if (!scale.empty() && scale.size() != static_cast<std::size_t>(inputs)) {
    throw std::invalid_argument("scale has " + std::to_string(scale.size()) + " numbers, " + function +
                                " has " + std::to_string(inputs) + " inputs");
  }
  BentChain result;
  std::vector<Matrix>& chain = result.stages;
  for (const std::string& name : names) {
    bool joins = true;  // the first layer acts on the selected inputs, and that of rho on the last of phi
    Unit before;        // of what is between the layer before and this one
    for (const files::Layer& layer : parts.at(name)->layers) {
      Matrix w(layer.outputs, layer.inputs, layer.weights);
      for (Dyadic& entry : w.entries)
        if (!joins) entry = entry * before.slope;
      if (chain.empty()) {
        chain.push_back(maps ? of_invariants(w, files::slope_of_inputs(network, function))
                             : selected_columns(w, coordinates, scale));
      } else if (joins) {
        chain.back() = product(w, chain.back());
      } else {
        chain.push_back(w);
      }
      joins = false;
      if (&layer == &parts.at(name)->layers.back()) continue;
      before = unit_of(files::function_of(layer.activation));
      result.bends.push_back(before.bend);
    }
  }
  return result;
}

namespace {

HiddenLayer hidden_layer(const files::Layer& layer, bool has_relu) {
  return {layer.outputs, layer.inputs, layer.weights, layer.biases, has_relu ? 0 : layer.outputs};
}

/// Parts of a box are decided for ReLU.
const std::vector<files::Layer>& relu_layers(const files::Network& network, const std::string& part) {
  const files::Weights& weights = *files::parts(network).at(part);
  if (!weights.is_relu()) throw std::invalid_argument(part + " is no ReLU network");
  return weights.layers;
}

/// The moving coordinates of `part` and their weights.
void set_coordinates(LocalFunction& f, const files::Network& network, const std::string& part,
                     const std::string& block, const std::vector<double>& scale) {
  f.coordinates = files::block_coordinates(network, part, block);
  if (!scale.empty() && scale.size() != static_cast<std::size_t>(f.hidden.front().inputs))
    throw std::invalid_argument("scale has not one number per input of " + part);
  for (const int k : f.coordinates)
    f.weight.push_back(scale.empty() ? 1.0 : scale.at(static_cast<std::size_t>(k)));
}

/// W' Q W of the last layer; no rows: W' W.
Matrix gram(const files::Layer& last, const Matrix& q) {
  const Matrix w(last.outputs, last.inputs, last.weights);
  Matrix transposed(last.inputs, last.outputs);
  for (int i = 0; i < last.outputs; ++i)
    for (int j = 0; j < last.inputs; ++j) transposed(j, i) = w(i, j);
  return product(transposed, q.rows == 0 ? w : product(q, w));
}

}  // namespace

LocalFunction local_function(const files::Network& network, const std::string& part, const std::string& block,
                             const std::vector<double>& scale, const Matrix& q) {
  const std::vector<files::Layer>& layers = relu_layers(network, part);
  const files::Layer& last = layers.back();
  if (layers.size() < 2) throw std::invalid_argument(part + " has no hidden layer");
  if (q.rows != 0 && q.rows != last.outputs)
    throw std::invalid_argument("the form is not of the outputs of " + part);
  LocalFunction f;
  for (std::size_t k = 0; k + 1 < layers.size(); ++k) f.hidden.push_back(hidden_layer(layers[k], true));
  f.gram = gram(last, q);
  set_coordinates(f, network, part, block, scale);
  return f;
}

std::vector<HiddenLayer> term_layers(const files::Network& network, const std::string& phi,
                                     const std::string& rho) {
  const std::vector<files::Layer>& behind = relu_layers(network, rho);
  if (behind.size() < 2) throw std::invalid_argument(rho + " has no hidden layer");
  std::vector<HiddenLayer> result;
  for (const files::Layer& layer : relu_layers(network, phi)) result.push_back(hidden_layer(layer, true));
  result.back().without_relu = result.back().outputs;
  result.push_back(hidden_layer(behind.front(), false));
  result.back().biases.assign(result.back().biases.size(), 0.0);
  return result;
}

LocalFunction coupled_function(const files::Network& network, const std::string& function,
                               const std::string& block, const std::vector<double>& scale,
                               const std::vector<double>& least, const std::vector<double>& most) {
  const std::vector<std::string> names = files::networks_of(function);
  LocalFunction f;
  f.hidden = term_layers(network, names[0], names[1]);
  if (f.hidden.size() < 3) throw std::invalid_argument(names[0] + " has no hidden layer");
  f.hidden.resize(f.hidden.size() - 2);
  const std::map<std::string, const files::Weights*> parts = files::parts(network);
  const std::vector<files::Layer>& behind = parts.at(names[1])->layers;
  f.behind = {hidden_layer(parts.at(names[0])->layers.back(), false)};
  for (std::size_t k = 0; k + 1 < behind.size(); ++k) f.behind.push_back(hidden_layer(behind[k], true));
  f.behind_gram = gram(behind.back(), Matrix(0, 0));
  f.behind[1].least = least;
  f.behind[1].most = most;
  set_coordinates(f, network, names[0], block, scale);
  return f;
}

}  // namespace swarmcert::check
