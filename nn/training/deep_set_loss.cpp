#include "nn/training/deep_set_loss.h"

#include <stdexcept>

namespace swarmcert::training {
namespace {

using Eigen::Index;

/// The input of a multilayer perceptron, then the output of each layer, after the ReLU if it has one.
using Activations = std::vector<Matrix>;

void forward(const Layout& layout, const Vector& theta, int part, Activations& all) {
  const int layers = layout.parts()[part].layers();
  all.resize(static_cast<std::size_t>(layers) + 1);
  for (int k = 0; k < layers; ++k) {
    Matrix& y = all[k + 1];
    y.noalias() = layout.weights(theta, part, k) * all[k];
    y.colwise() += layout.biases(theta, part, k);
    if (k + 1 < layers) y = y.cwiseMax(0.0f);
  }
}

/// Backpropagates `error`: adds the gradient of the part to `gradient` and, if requested, replaces `error` by its value
/// at the input.
void backward(const Layout& layout, const Vector& theta, int part, const Activations& all, Matrix& error,
              Vector& gradient, bool needs_input_error) {
  for (int k = layout.parts()[part].layers() - 1; k >= 0; --k) {
    if (k + 1 < layout.parts()[part].layers())
      error = (all[k + 1].array() > 0.0f).select(error.array(), 0.0f).matrix();
    layout.weights(gradient, part, k).noalias() += error * all[k].transpose();
    layout.biases(gradient, part, k) += error.rowwise().sum();
    if (k == 0 && !needs_input_error) return;
    const Matrix before = layout.weights(theta, part, k).transpose() * error;
    error = before;
  }
}

/// The columns that pass through one part.
struct Group {
  int part = 0;
  std::vector<Index> columns;  ///< of the dataset's x for phi, of the batch for rho
  std::vector<Index> owner;    ///< phi: for each column, its sample in the batch
  Activations activations;
};

Group& group_of(std::vector<Group>& groups, int part) {
  for (Group& group : groups) {
    if (group.part == part) return group;
  }
  groups.emplace_back();
  groups.back().part = part;
  return groups.back();
}

/// One batch after the forward pass.
struct Batch {
  std::vector<Group> phi, rho;
  Matrix output;  ///< [outputs x samples of the batch]
  Index features = 0;
};

Batch run(const Layout& layout, const Vector& theta, const Dataset& data, const Index* samples, Index count) {
  Batch batch;
  for (Index s = 0; s < count; ++s) {
    for (Index i = data.first[samples[s]]; i < data.first[samples[s] + 1]; ++i) {
      Group& group = group_of(batch.phi, data.phi[i]);
      group.columns.push_back(i);
      group.owner.push_back(s);
    }
    group_of(batch.rho, data.rho[samples[s]]).columns.push_back(s);
  }
  batch.output.resize(data.outputs, count);
  if (count == 0) return batch;
  batch.features = layout.parts()[batch.rho.front().part].inputs();
  Matrix sum = Matrix::Zero(batch.features, count);
  for (Group& group : batch.phi) {
    const Index inputs = layout.parts()[group.part].inputs();
    group.activations.resize(1);
    Matrix& x = group.activations.front();
    x.resize(inputs, static_cast<Index>(group.columns.size()));
    for (std::size_t c = 0; c < group.columns.size(); ++c) {
      x.col(static_cast<Index>(c)) =
          Eigen::Map<const Vector>(data.x.data() + group.columns[c] * data.width, inputs);
    }
    forward(layout, theta, group.part, group.activations);
    for (std::size_t c = 0; c < group.columns.size(); ++c)
      sum.col(group.owner[c]) += group.activations.back().col(static_cast<Index>(c));
  }
  for (Group& group : batch.rho) {
    group.activations.resize(1);
    group.activations.front() = sum(Eigen::all, group.columns);
    forward(layout, theta, group.part, group.activations);
    batch.output(Eigen::all, group.columns) = group.activations.back();
  }
  return batch;
}

}  // namespace

void Dataset::add_input(int phi_part, const std::vector<float>& values) {
  if (static_cast<int>(values.size()) > width)
    throw std::invalid_argument("an input is wider than the dataset");
  x.insert(x.end(), values.begin(), values.end());
  x.insert(x.end(), static_cast<std::size_t>(width) - values.size(), 0.0f);
  phi.push_back(phi_part);
}

void Dataset::add_sample(int rho_part, const std::vector<float>& force, float sample_weight) {
  if (static_cast<int>(force.size()) != outputs) throw std::invalid_argument("a force has the wrong size");
  first.push_back(static_cast<Index>(phi.size()));
  rho.push_back(rho_part);
  target.insert(target.end(), force.begin(), force.end());
  weight.push_back(sample_weight);
}

double deep_set_loss(const Layout& layout, const Vector& theta, const Dataset& data, const Index* samples,
                     Index count, Vector* gradient) {
  Batch batch = run(layout, theta, data, samples, count);
  Matrix& error = batch.output;  // reused for d loss / d output
  double loss = 0;
  for (Index s = 0; s < count; ++s) {
    const float weight = data.weight[samples[s]];
    error.col(s) -= data.target_of(samples[s]);
    loss += static_cast<double>(weight) * error.col(s).cast<double>().squaredNorm();
    error.col(s) *= 2 * weight;
  }
  if (gradient == nullptr) return loss;
  Matrix feature_error = Matrix::Zero(batch.features, count);
  for (const Group& group : batch.rho) {
    Matrix part_error = error(Eigen::all, group.columns);
    backward(layout, theta, group.part, group.activations, part_error, *gradient, true);
    feature_error(Eigen::all, group.columns) = part_error;
  }
  for (const Group& group : batch.phi) {
    Matrix part_error = feature_error(Eigen::all, group.owner);
    backward(layout, theta, group.part, group.activations, part_error, *gradient, false);
  }
  return loss;
}

Matrix predict(const Layout& layout, const Vector& theta, const Dataset& data, const Index* samples,
               Index count) {
  return run(layout, theta, data, samples, count).output;
}

Matrix part_output(const Layout& layout, const Vector& theta, int part, const Matrix& x) {
  Activations all = {x};
  forward(layout, theta, part, all);
  return all.back();
}

}  // namespace swarmcert::training
