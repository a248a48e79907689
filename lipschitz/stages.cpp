#include "lipschitz/stages.h"

#include <map>
#include <stdexcept>

#include "lipschitz/checker/lipschitz_lmi.h"
#include "nn/files/functions.h"

namespace swarmcert::check {

std::vector<Matrix> stages(const files::Network& network, const std::string& function,
                           const std::string& block, const std::vector<double>& scale) {
  const std::map<std::string, const files::Weights*> parts = files::parts(network);
  const std::vector<std::string> names = files::networks_of(function);
  const std::vector<int> coordinates = files::block_coordinates(network, function, block);
  Matrix selector(parts.at(names.front())->inputs(), static_cast<int>(coordinates.size()));
  if (!scale.empty() && scale.size() != static_cast<std::size_t>(selector.rows)) {
    throw std::invalid_argument("scale has " + std::to_string(scale.size()) + " numbers, " + function +
                                " has " + std::to_string(selector.rows) + " inputs");
  }
  for (int j = 0; j < selector.cols; ++j)
    selector(coordinates[j], j) = scale.empty() ? 1.0 : scale[coordinates[j]];
  std::vector<Matrix> chain = {selector};
  for (const std::string& name : names) {
    bool joins = true;  // the first layer acts on the selected inputs, and that of rho on the last of phi
    for (const files::Layer& layer : parts.at(name)->layers) {
      const Matrix w(layer.outputs, layer.inputs, layer.weights);
      if (joins) {
        chain.back() = product(w, chain.back());
      } else {
        chain.push_back(w);
      }
      joins = false;
    }
  }
  return chain;
}

LocalFunction local_function(const files::Network& network, const std::string& part, const std::string& block,
                             const std::vector<double>& scale, const Matrix& q) {
  const std::vector<files::Layer>& layers = files::parts(network).at(part)->layers;
  const files::Layer& last = layers.back();
  if (layers.size() < 2) throw std::invalid_argument(part + " has no hidden layer");
  if (q.rows != 0 && q.rows != last.outputs)
    throw std::invalid_argument("the form is not of the outputs of " + part);
  LocalFunction f;
  for (std::size_t k = 0; k + 1 < layers.size(); ++k)
    f.hidden.push_back({layers[k].outputs, layers[k].inputs, layers[k].weights, layers[k].biases});
  const Matrix w(last.outputs, last.inputs, last.weights);
  Matrix transposed(last.inputs, last.outputs);
  for (int i = 0; i < last.outputs; ++i)
    for (int j = 0; j < last.inputs; ++j) transposed(j, i) = w(i, j);
  f.gram = product(transposed, q.rows == 0 ? w : product(q, w));
  f.coordinates = files::block_coordinates(network, part, block);
  if (!scale.empty() && scale.size() != static_cast<std::size_t>(layers.front().inputs))
    throw std::invalid_argument("scale has not one number per input of " + part);
  for (const int k : f.coordinates)
    f.weight.push_back(scale.empty() ? 1.0 : scale.at(static_cast<std::size_t>(k)));
  return f;
}

}  // namespace swarmcert::check
