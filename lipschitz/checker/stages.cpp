#include "lipschitz/checker/stages.h"

#include <algorithm>
#include <functional>
#include <map>
#include <stdexcept>

#include "lipschitz/checker/centred_form.h"
#include "lipschitz/checker/lipschitz_lmi.h"
#include "nn/weights/functions.h"

namespace swarmcert::check {
namespace {

/// Returns the columns of W for these inputs, each times its scale if there is one.
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

/// The divisor of an activation, and the slope range of the quotient: [0, 1], [1 - c, c], or [-1, 1] of groups.
struct Unit {
  Dyadic slope;
  SlopeRange range;
};

Unit unit_of(const files::ActivationFunction& function) {
  if (function.sorts()) return {1.0, {-1.0, 1.0}};
  if (function.is_monotone()) return {function.greatest_slope, {0.0, 1.0}};
  if (function.least_slope != 1 - function.greatest_slope)
    throw std::logic_error(function.op + ": slopes that do not add up to 1");
  return {1.0, {function.least_slope, function.greatest_slope}};
}

/// MaxMin sorts groups of two whose numbers are not adjacent. Returns the place of each number of a layer of `size`
/// where they are: of what enters it, or of what leaves it.
std::vector<int> places(files::Activation activation, int size, bool enters) {
  std::vector<int> result(static_cast<std::size_t>(size));
  const bool is_halves = activation == files::Activation::kMaxMinHalves;
  const bool is_turned = is_halves || activation == files::Activation::kMaxMinPairs;
  for (int i = 0, h = size / 2; i < size; ++i)
    result[static_cast<std::size_t>(i)] = !is_turned || (enters && !is_halves) ? i
                                          : enters                             ? 2 * (i % h) + i / h
                                                                               : 2 * (i % h) + 1 - i / h;
  return result;
}

/// Puts the rows of a layer, and its columns, to where the groups that they enter, and leave, are adjacent.
Matrix with_adjacent_groups(const files::Weights& weights, std::size_t k) {
  const files::Layer& layer = weights.layers[k];
  const Matrix w(layer.outputs, layer.inputs, layer.weights);
  const bool is_last = k + 1 == weights.layers.size();
  const std::vector<int> rows =
      places(is_last ? files::Activation::kRelu : layer.activation, layer.outputs, true);
  const std::vector<int> columns =
      places(k == 0 ? files::Activation::kRelu : weights.layers[k - 1].activation, layer.inputs, false);
  Matrix result = w;
  for (int i = 0; i < w.rows; ++i)
    for (int j = 0; j < w.cols; ++j)
      result(rows[static_cast<std::size_t>(i)], columns[static_cast<std::size_t>(j)]) = w(i, j);
  return result;
}

/// Returns the factor of the activation of layer k.
using FactorOf = std::function<Dyadic(const files::Weights& weights, std::size_t k)>;

/// Returns the stages of `function`. The stage behind the activation of a layer is multiplied by the layer's `factor`,
/// for the entries to which the activation applies.
std::vector<Matrix> chained(const files::Network& network, const files::FunctionId& function,
                            const std::string& block, const std::vector<double>& scale,
                            const FactorOf& factor) {
  const files::Parts parts = files::parts(network);
  const std::vector<files::FunctionId> names = function.parts();
  const std::vector<int> coordinates = files::block_coordinates(network, function, block);
  const int inputs = parts.at(names.front())->inputs();
  if (!scale.empty() && scale.size() != static_cast<std::size_t>(inputs)) {
    throw std::invalid_argument("scale has " + std::to_string(scale.size()) + " numbers, " + function.name() +
                                " has " + std::to_string(inputs) + " inputs");
  }
  std::vector<Matrix> chain;
  for (const files::FunctionId& name : names) {
    const files::Weights& weights = *parts.at(name);
    for (std::size_t k = 0; k < weights.layers.size(); ++k) {
      Matrix w = with_adjacent_groups(weights, k);
      if (chain.empty()) {  // the first layer acts on the inputs, the first of rho on the last of phi
        chain.push_back(selected_columns(w, coordinates, scale));
      } else if (k == 0) {
        chain.back() = product(w, chain.back());
      } else {
        const Dyadic before = factor(weights, k - 1);
        for (int i = 0; i < w.rows; ++i)
          for (int j = 0; j < w.cols - weights.layers[k - 1].kept; ++j) w(i, j) = w(i, j) * before;
        chain.push_back(std::move(w));
      }
    }
  }
  return chain;
}

/// Returns the activation between layer k and the next one.
const files::ActivationFunction& function_after(const files::Weights& weights, std::size_t k) {
  return files::function_of(weights.layers.at(k).activation);
}

}  // namespace

std::vector<Matrix> stages(const files::Network& network, const files::FunctionId& function,
                           const std::string& block, const std::vector<double>& scale) {
  BentChain chain = bent_chain(network, function, block, scale);
  if (chain.is_bent())
    throw std::domain_error(function.name() +
                            " has activations that are not monotone: slopes are not in [0, b]");
  return std::move(chain.stages);
}

BentChain bent_chain(const files::Network& network, const files::FunctionId& function,
                     const std::string& block, const std::vector<double>& scale) {
  BentChain result;  // entries that a layer keeps have slope 1, which is in [0, 1] and in [1 - c, c]
  result.stages = chained(network, function, block, scale, [](const files::Weights& weights, std::size_t k) {
    return unit_of(function_after(weights, k)).slope;
  });
  const files::Parts parts = files::parts(network);
  for (const files::FunctionId& name : function.parts()) {
    const files::Weights& weights = *parts.at(name);
    for (std::size_t k = 0; k + 1 < weights.layers.size(); ++k) {
      result.slopes.insert(result.slopes.end(), static_cast<std::size_t>(weights.layers[k].outputs),
                           unit_of(function_after(weights, k)).range);
      result.groups.push_back(function_after(weights, k).group);
    }
  }
  return result;
}

BentChain chain_on_box(const files::Network& network, const files::FunctionId& function,
                       const std::string& block, const std::vector<double>& scale, const Intervals& box) {
  if (function.is_rho()) throw std::domain_error(function.name() + " has no box");
  BentChain result;
  result.stages = chained(network, function, block, scale,
                          [](const files::Weights&, std::size_t) { return Dyadic(1.0); });
  const files::Parts parts = files::parts(network);
  const std::vector<files::FunctionId> names = function.parts();
  for (const files::FunctionId& name : names)
    for (std::size_t k = 0; k + 1 < parts.at(name)->layers.size(); ++k)
      if (function_after(*parts.at(name), k).sorts())
        throw std::domain_error(name.name() + " sorts a layer, which has no entrywise slopes");
  for (const std::vector<Interval>& layer : slopes_on_box(*parts.at(names.front()), box))
    for (const Interval& slopes : layer) result.slopes.push_back({slopes.lower, slopes.upper});
  if (names.size() == 1) return result;
  const files::Weights& behind = *parts.at(names.back());
  for (std::size_t k = 0; k + 1 < behind.layers.size(); ++k) {
    const files::ActivationFunction& after = function_after(behind, k);
    const auto kept = static_cast<std::size_t>(behind.layers[k].kept);
    result.slopes.insert(result.slopes.end(), static_cast<std::size_t>(behind.layers[k].outputs) - kept,
                         {after.least_slope, after.greatest_slope});
    result.slopes.insert(result.slopes.end(), kept, {kKeptSlopes.lower, kKeptSlopes.upper});
  }
  return result;
}

Dyadic steepest_on_box(const files::Weights& weights, const Intervals& box) {
  Dyadic total = 1.0;
  for (const std::vector<Interval>& layer : slopes_on_box(weights, box)) {
    Dyadic steepest = layer.empty() ? 1.0 : 0.0;  // empty: the layer is sorted
    for (const Interval& slopes : layer) steepest = std::max({steepest, slopes.upper, -slopes.lower});
    total = total * steepest;
  }
  return total;
}

namespace {

HiddenLayer hidden_layer(const files::Layer& layer, bool has_relu) {
  return {layer.outputs, layer.inputs, layer.weights, layer.biases, has_relu ? 0 : layer.outputs};
}

/// Returns the layers of `part`, which must be a ReLU network, because proofs by parts of a box support only ReLU.
const std::vector<files::Layer>& relu_layers(const files::Network& network, const files::FunctionId& part) {
  const files::Weights& weights = *files::parts(network).at(part);
  if (!weights.is_relu()) throw std::invalid_argument(part.name() + " is not a ReLU network");
  return weights.layers;
}

/// Sets the moving coordinates of `part` and their weights.
void set_coordinates(LocalFunction& f, const files::Network& network, const files::FunctionId& part,
                     const std::string& block, const std::vector<double>& scale) {
  f.coordinates = files::block_coordinates(network, part, block);
  if (!scale.empty() && scale.size() != static_cast<std::size_t>(f.hidden.front().inputs))
    throw std::invalid_argument("scale must have one number per input of " + part.name());
  for (const int k : f.coordinates)
    f.weight.push_back(scale.empty() ? 1.0 : scale.at(static_cast<std::size_t>(k)));
}

/// Returns W' Q W for the last layer; W' W if Q has no rows.
Matrix gram(const files::Layer& last, const Matrix& q) {
  const Matrix w(last.outputs, last.inputs, last.weights);
  Matrix transposed(last.inputs, last.outputs);
  for (int i = 0; i < last.outputs; ++i)
    for (int j = 0; j < last.inputs; ++j) transposed(j, i) = w(i, j);
  return product(transposed, q.rows == 0 ? w : product(q, w));
}

}  // namespace

LocalFunction local_function(const files::Network& network, const files::FunctionId& part,
                             const std::string& block, const std::vector<double>& scale, const Matrix& q) {
  const std::vector<files::Layer>& layers = relu_layers(network, part);
  const files::Layer& last = layers.back();
  if (layers.size() < 2) throw std::invalid_argument(part.name() + " has no hidden layer");
  if (q.rows != 0 && q.rows != last.outputs)
    throw std::invalid_argument("the form does not fit the outputs of " + part.name());
  LocalFunction f;
  for (std::size_t k = 0; k + 1 < layers.size(); ++k) f.hidden.push_back(hidden_layer(layers[k], true));
  f.gram = gram(last, q);
  set_coordinates(f, network, part, block, scale);
  return f;
}

std::vector<HiddenLayer> term_layers(const files::Network& network, const files::FunctionId& phi,
                                     const files::FunctionId& rho) {
  const std::vector<files::Layer>& behind = relu_layers(network, rho);
  if (behind.size() < 2) throw std::invalid_argument(rho.name() + " has no hidden layer");
  std::vector<HiddenLayer> result;
  for (const files::Layer& layer : relu_layers(network, phi)) result.push_back(hidden_layer(layer, true));
  result.back().without_relu = result.back().outputs;
  result.push_back(hidden_layer(behind.front(), false));
  result.back().biases.assign(result.back().biases.size(), 0.0);
  return result;
}

LocalFunction coupled_function(const files::Network& network, const files::FunctionId& function,
                               const std::string& block, const std::vector<double>& scale,
                               const std::vector<double>& least, const std::vector<double>& most) {
  const std::vector<files::FunctionId> names = function.parts();
  LocalFunction f;
  f.hidden = term_layers(network, names[0], names[1]);
  if (f.hidden.size() < 3) throw std::invalid_argument(names[0].name() + " has no hidden layer");
  f.hidden.resize(f.hidden.size() - 2);
  const files::Parts parts = files::parts(network);
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
