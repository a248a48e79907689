#include "lipschitz/values/reach.h"

#include <cmath>
#include <utility>

#include "lipschitz/solver/dense_kernels.h"
#include "lipschitz/values/relu_lines.h"
#include "nn/base/doubles.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kUnderflow = 0x1p-900;

/// gamma_n = n u / (1 - n u), and a little more, so that products with it round safely.
double gamma(Index n) { return 1.001 * static_cast<double>(n + 2) * kUnit; }

VectorXd side(const std::vector<double>& values) {
  return Eigen::Map<const VectorXd>(values.data(), static_cast<Index>(values.size()));
}

VectorXd largest_input(const Box& box) {
  return side(box.lower).cwiseAbs().cwiseMax(side(box.upper).cwiseAbs());
}

/// Twice the unit roundoff per operation that a constant may go through.
double rounding_per_term(const ReachNetwork& network) {
  Index terms = 8;
  for (const ReachLayer& layer : network) terms += 2 * layer.weights.rows() + 2 * layer.weights.cols();
  return 2 * static_cast<double>(terms) * kUnit;
}

}  // namespace

ReachNetwork reach_network(const files::Weights& weights) {
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  ReachNetwork network;
  for (const files::Layer& layer : weights.layers) {
    network.push_back({Eigen::Map<const RowMajor>(layer.weights.data(), layer.outputs, layer.inputs),
                       Eigen::Map<const VectorXd>(layer.biases.data(), layer.outputs),
                       VectorXd::Zero(layer.outputs), true});
  }
  network.back().has_relu = false;
  return network;
}

Reach::Reach(const ReachNetwork& network, const Box& box, const Reach* around, std::vector<MatrixXd>* slopes,
             std::vector<LinearForms>* forms, std::vector<check::Decision>* decided)
    : network_(network), box_(box) {
  add_layers(around, slopes, forms, decided);
}

Reach::Reach(const ReachNetwork& network, const Box& box, Support support)
    : network_(network), box_(box), support_(std::move(support)) {
  add_layers(nullptr, nullptr, nullptr, nullptr);
}

Reach::Reach(const ReachNetwork& network, const Reach& first, const Reach* around,
             std::vector<check::Decision>* decided)
    : network_(network), box_(first.box_), bounds_(first.bounds_), term_magnitude_(first.term_magnitude_) {
  add_layers(around, nullptr, nullptr, decided);
}

void Reach::add_layers(const Reach* around, std::vector<MatrixXd>* slopes, std::vector<LinearForms>* forms,
                       std::vector<check::Decision>* decided) {
  const auto after_relu = [](const ReachLayer& layer, const Bounds& bounds) {
    return layer.has_relu ? VectorXd(bounds.upper.cwiseMax(0.0)) : bounds.magnitude();
  };
  relative_ = rounding_per_term(network_);
  ActiveLayers layers = active_layers(bounds_.size());
  for (std::size_t k = bounds_.size(); k < network_.size(); ++k) {
    const ReachLayer& layer = network_[k];
    const VectorXd magnitude = k == 0 ? largest_input(box_) : after_relu(network_[k - 1], bounds_.back());
    const Index rows = layer.weights.rows();
    term_magnitude_.emplace_back(layer.weights.cwiseAbs() * magnitude + layer.bias.cwiseAbs() +
                                 layer.bias_radius);
    // The larger box's bounds hold here; they do for neurons that it decides, whose exact range no relaxation needs.
    Bounds bounds = around != nullptr
                        ? around->bounds_[k]
                        : Bounds{VectorXd::Constant(rows, -kInfinity), VectorXd::Constant(rows, kInfinity)};
    std::vector<Index> open;
    for (Index i = 0; i < rows; ++i)
      if (!layer.has_relu || (bounds.lower(i) < 0 && bounds.upper(i) > 0)) open.push_back(i);
    const auto count = static_cast<Index>(open.size());
    const LinearForms found = around_outputs(layers, open);
    VectorXd ends = largest(found);
    if (decided != nullptr && k > 0 && layer.has_relu) decide(layers, open, found, ends, *decided);
    if (forms != nullptr) {
      forms->push_back({MatrixXd::Zero(2 * rows, network_.front().weights.cols()),
                        VectorXd::Constant(2 * rows, kInfinity)});
      for (Index i = 0; i < 2 * count; ++i) {
        const Index row = open[static_cast<std::size_t>(i % count)] + (i < count ? 0 : rows);
        forms->back().rows.row(row) = found.rows.row(i);
        forms->back().constants(row) = found.constants(i);
      }
    }
    if (slopes != nullptr) slopes->push_back(MatrixXd::Zero(rows, network_.front().weights.cols()));
    for (Index i = 0; i < count; ++i) {
      double& lower = bounds.lower(open[static_cast<std::size_t>(i)]);
      double& upper = bounds.upper(open[static_cast<std::size_t>(i)]);
      if (-ends(count + i) > lower) lower = -ends(count + i);  // false for NaN
      if (ends(i) < upper) upper = ends(i);
      if (slopes != nullptr)
        slopes->back().row(open[static_cast<std::size_t>(i)]) =
            0.5 * (found.rows.row(i).cwiseAbs() + found.rows.row(count + i).cwiseAbs());
    }
    bounds_.push_back(std::move(bounds));
    append(layers);
  }
}

ReluLines Reach::lines(std::size_t j) const {
  const ReachLayer& layer = network_[j];
  const Bounds& bounds = bounds_[j];
  ReluLines result;
  for (Index i = 0; i < layer.weights.rows(); ++i)
    if (!layer.has_relu || bounds.lower(i) >= 0 || !(bounds.upper(i) <= 0)) result.neurons.push_back(i);
  const auto size = static_cast<Index>(result.neurons.size());
  result.slope = result.below = VectorXd::Ones(size);
  result.offset = result.line_error = VectorXd::Zero(size);
  result.bias = layer.bias(result.neurons);
  result.layer_error = layer_error(j)(result.neurons);
  for (Index n = 0; n < size && layer.has_relu; ++n) {
    const Index i = result.neurons[static_cast<std::size_t>(n)];
    const double l = bounds.lower(i), u = bounds.upper(i);
    if (l >= 0) continue;
    const double slope = u / (u - l);
    result.slope(n) = slope;
    result.offset(n) = std::max({0.0, up(u - down(slope * u)), up(-slope * l)});
    result.below(n) = u > -l ? 1.0 : 0.0;
    result.line_error(n) = relative_ * result.offset(n) + 4 * kUnit * slope * std::max(u, -l);
  }
  return result;
}

VectorXd Reach::layer_error(std::size_t j) const {
  const ReachLayer& layer = network_[j];
  return gamma(layer.weights.rows()) * term_magnitude_[j] + layer.bias_radius +
         relative_ * (layer.bias.cwiseAbs() + layer.bias_radius);
}

void Reach::append(ActiveLayers& layers) const {
  const std::size_t j = layers.lines.size();
  layers.lines.push_back(lines(j));
  const std::vector<Index>& neurons = layers.lines[j].neurons;
  layers.weights.push_back(j == 0 ? MatrixXd(network_[j].weights(neurons, Eigen::all))
                                  : MatrixXd(network_[j].weights(neurons, layers.lines[j - 1].neurons)));
}

ActiveLayers Reach::active_layers(std::size_t count) const {
  ActiveLayers layers;
  while (layers.lines.size() < count) append(layers);
  return layers;
}

LinearForms Reach::substituted(const ActiveLayers& layers, const MatrixXd& directions,
                               const std::vector<MatrixXd>* given_below) const {
  const std::size_t top = layers.lines.size();
  MatrixXd lambda = directions;
  if (top > 0) {
    lambda = MatrixXd::Zero(directions.rows(), layers.weights[top - 1].rows());
    add_product(lambda, directions,
                MatrixXd(network_[top].weights(Eigen::all, layers.lines[top - 1].neurons)));
  } else {
    lambda = MatrixXd::Zero(directions.rows(), network_[0].weights.cols());
    add_product(lambda, directions, network_[0].weights);
  }
  return pulled_back(layers, {std::move(lambda), directions * network_[top].bias},
                     directions.cwiseAbs() * layer_error(top), given_below);
}

LinearForms Reach::around_outputs(const ActiveLayers& layers, const std::vector<Index>& outputs) const {
  const std::size_t top = layers.lines.size();
  const MatrixXd rows = top > 0 ? MatrixXd(network_[top].weights(outputs, layers.lines[top - 1].neurons))
                                : MatrixXd(network_[top].weights(outputs, Eigen::all));
  const VectorXd bias = network_[top].bias(outputs), error = layer_error(top)(outputs);
  LinearForms both{MatrixXd(2 * rows.rows(), rows.cols()), VectorXd(2 * rows.rows())};
  both.rows << rows, -rows;
  both.constants << bias, -bias;
  VectorXd errors(2 * rows.rows());
  errors << error, error;
  return pulled_back(layers, std::move(both), std::move(errors), nullptr);
}

LinearForms Reach::pulled_back(const ActiveLayers& layers, LinearForms forms, VectorXd error,
                               const std::vector<MatrixXd>* given_below) const {
  for (std::size_t j = layers.lines.size(); j-- > 0;) {
    pull_back(layers.lines[j], given_below != nullptr ? &(*given_below)[j] : nullptr, forms.rows,
              forms.constants, error);
    MatrixXd next = MatrixXd::Zero(forms.rows.rows(), layers.weights[j].cols());
    add_product(next, forms.rows, layers.weights[j]);
    forms.rows = std::move(next);
  }
  forms.constants += (1 + 1e-9) * error + VectorXd::Constant(error.size(), kUnderflow);
  return forms;
}

LinearForms Reach::upper_forms(const MatrixXd& directions) const {
  return substituted(active_layers(network_.size() - 1), directions);
}

VectorXd Reach::largest(const LinearForms& forms) const {
  const VectorXd lower = side(box_.lower);
  const VectorXd upper = side(box_.upper);
  const VectorXd value =
      forms.rows.cwiseMax(0.0) * upper + forms.rows.cwiseMin(0.0) * lower + forms.constants;
  const VectorXd absolute = forms.rows.cwiseAbs() * largest_input(box_) + forms.constants.cwiseAbs();
  const double relative = 4 * static_cast<double>(forms.rows.cols() + 8) * kUnit;
  VectorXd result = value + relative * absolute + VectorXd::Constant(value.size(), kUnderflow);
  for (double& x : result) x = std::isnan(x) ? kInfinity : up(x);
  return support_ ? VectorXd(result.cwiseMin(support_(forms))) : result;
}

VectorXd Reach::influence(const Eigen::RowVectorXd& direction) const {
  VectorXd middle = direction.transpose(), radius = VectorXd::Zero(middle.size());
  for (std::size_t j = network_.size(); j-- > 0;) {
    middle = (network_[j].weights.transpose() * middle).eval();
    radius = (network_[j].weights.transpose().cwiseAbs() * radius).eval();
    if (j == 0 || !network_[j - 1].has_relu) continue;
    const Bounds& bounds = bounds_[j - 1];
    for (Index i = 0; i < middle.size(); ++i) {
      if (bounds.lower(i) >= 0) continue;
      const bool off = bounds.upper(i) <= 0;
      const double least = off ? 0 : std::min(0.0, middle(i) - radius(i));
      const double most = off ? 0 : std::max(0.0, middle(i) + radius(i));
      middle(i) = (least + most) / 2;
      radius(i) = (most - least) / 2;
    }
  }
  return middle.cwiseAbs() + radius;
}

VectorXd evaluate_roughly(const ReachNetwork& network, const VectorXd& x) {
  VectorXd h = x;
  for (const ReachLayer& layer : network) {
    h = layer.weights * h + layer.bias;
    if (layer.has_relu) h = h.cwiseMax(0.0);
  }
  return h;
}

std::pair<Box, Box> halves(const Box& box, Index k) {
  std::pair<Box, Box> result{box, box};
  const auto i = static_cast<std::size_t>(k);
  const double middle = box.lower[i] + (box.upper[i] - box.lower[i]) / 2;
  result.first.upper[i] = result.second.lower[i] = middle;
  return result;
}

}  // namespace swarmcert::lipschitz
