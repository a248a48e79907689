#include "nn/training/layout.h"

#include <cmath>
#include <stdexcept>

#include "nn/base/random.h"

namespace swarmcert::training {

Layout::Layout(std::vector<Part> parts) : parts_(std::move(parts)) {
  for (Part& part : parts_) {
    if (part.layers() < 1) throw std::invalid_argument(part.id.name() + ": no layer");
    part.begin = size_;
    for (int k = 0; k < part.layers(); ++k) {
      if (part.sizes[k] < 1 || part.sizes[k + 1] < 1)
        throw std::invalid_argument(part.id.name() + ": empty layer");
      size_ += static_cast<Eigen::Index>(part.sizes[k] + 1) * part.sizes[k + 1];
    }
  }
}

int Layout::find(const files::FunctionId& id) const {
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    if (parts_[i].id == id) return static_cast<int>(i);
  }
  return -1;
}

Eigen::Index Layout::offset(int part, int layer) const {
  const Part& p = parts_[part];
  Eigen::Index at = p.begin;
  for (int k = 0; k < layer; ++k) at += static_cast<Eigen::Index>(p.sizes[k] + 1) * p.sizes[k + 1];
  return at;
}

Eigen::Map<Matrix> Layout::weights(Vector& theta, int part, int layer) const {
  const Part& p = parts_[part];
  return {theta.data() + offset(part, layer), p.sizes[layer + 1], p.sizes[layer]};
}

Eigen::Map<const Matrix> Layout::weights(const Vector& theta, int part, int layer) const {
  const Part& p = parts_[part];
  return {theta.data() + offset(part, layer), p.sizes[layer + 1], p.sizes[layer]};
}

Eigen::Map<Vector> Layout::biases(Vector& theta, int part, int layer) const {
  const Part& p = parts_[part];
  const Eigen::Index weights = static_cast<Eigen::Index>(p.sizes[layer]) * p.sizes[layer + 1];
  return {theta.data() + offset(part, layer) + weights, p.sizes[layer + 1]};
}

Eigen::Map<const Vector> Layout::biases(const Vector& theta, int part, int layer) const {
  const Part& p = parts_[part];
  const Eigen::Index weights = static_cast<Eigen::Index>(p.sizes[layer]) * p.sizes[layer + 1];
  return {theta.data() + offset(part, layer) + weights, p.sizes[layer + 1]};
}

files::Weights Layout::stored(const Vector& theta, int part) const {
  files::Weights result;
  result.precision = files::Precision::kFloat32;
  for (int k = 0; k < parts_[part].layers(); ++k) {
    const Eigen::Map<const Matrix> w = weights(theta, part, k);
    const Eigen::Map<const Vector> b = biases(theta, part, k);
    files::Layer layer;
    layer.name = "fc" + std::to_string(k + 1);
    layer.outputs = static_cast<int>(w.rows());
    layer.inputs = static_cast<int>(w.cols());
    for (Eigen::Index i = 0; i < w.rows(); ++i) {
      for (Eigen::Index j = 0; j < w.cols(); ++j) layer.weights.push_back(static_cast<double>(w(i, j)));
      layer.biases.push_back(static_cast<double>(b(i)));
    }
    result.layers.push_back(std::move(layer));
  }
  return result;
}

void Layout::load(Vector& theta, int part, const files::Weights& stored_part) const {
  const Part& p = parts_[part];
  if (static_cast<int>(stored_part.layers.size()) != p.layers())
    throw std::invalid_argument(p.id.name() + ": wrong number of layers");
  for (int k = 0; k < p.layers(); ++k) {
    const files::Layer& layer = stored_part.layers[k];
    Eigen::Map<Matrix> w = weights(theta, part, k);
    Eigen::Map<Vector> b = biases(theta, part, k);
    if (layer.outputs != w.rows() || layer.inputs != w.cols())
      throw std::invalid_argument(p.id.name() + ": wrong size of layer " + layer.name);
    for (int i = 0; i < layer.outputs; ++i) {
      for (int j = 0; j < layer.inputs; ++j)
        w(i, j) = static_cast<float>(layer.weights[static_cast<std::size_t>(i) * layer.inputs + j]);
      b(i) = static_cast<float>(layer.biases[i]);
    }
  }
}

Vector initial_parameters(const Layout& layout, std::uint64_t seed) {
  files::Random random(seed);
  Vector theta(layout.size());
  for (const Part& part : layout.parts()) {
    Eigen::Index at = part.begin;
    for (int k = 0; k < part.layers(); ++k) {
      const double bound = 1 / std::sqrt(static_cast<double>(part.sizes[k]));
      const Eigen::Index count = static_cast<Eigen::Index>(part.sizes[k] + 1) * part.sizes[k + 1];
      for (Eigen::Index i = 0; i < count; ++i) theta(at++) = static_cast<float>(bound * random.symmetric());
    }
  }
  return theta;
}

}  // namespace swarmcert::training
