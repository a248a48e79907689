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

}  // namespace swarmcert::check
