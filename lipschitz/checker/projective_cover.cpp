#include "lipschitz/checker/projective_cover.h"

namespace swarmcert::check {

LocalFunction homogeneous(const LocalFunction& f) {
  LocalFunction result = f;
  result.behind.clear();
  for (std::size_t k = 0; k < f.hidden.size(); ++k) {
    const HiddenLayer& layer = f.hidden[k];
    const bool is_last = k + 1 == f.hidden.size();
    HiddenLayer wider{layer.outputs + (is_last ? 0 : 1), layer.inputs + 1, {}, {}};
    for (int i = 0; i < layer.outputs; ++i) {
      const auto row = layer.weights.begin() + static_cast<std::ptrdiff_t>(i) * layer.inputs;
      wider.weights.insert(wider.weights.end(), row, row + layer.inputs);
      wider.weights.push_back(layer.biases[static_cast<std::size_t>(i)]);
    }
    if (!is_last) {
      wider.weights.insert(wider.weights.end(), static_cast<std::size_t>(layer.inputs), 0.0);
      wider.weights.push_back(1.0);
      wider.without_relu = 1;
    }
    wider.biases.assign(static_cast<std::size_t>(wider.outputs), 0.0);
    result.hidden[k] = std::move(wider);
  }
  return result;
}

std::vector<Sides> projective_cover(const std::vector<double>& radius) {
  Sides inner{{}, radius};
  for (const double r : radius) inner.lower.push_back(-r);
  inner.lower.push_back(1);
  inner.upper.push_back(1);
  std::vector<Sides> boxes = {inner};
  inner.lower.back() = 0;
  for (std::size_t k = 0; k < radius.size(); ++k) {
    for (const double side : {-radius[k], radius[k]}) {
      boxes.push_back(inner);
      boxes.back().lower[k] = boxes.back().upper[k] = side;
    }
  }
  return boxes;
}

}  // namespace swarmcert::check
