#include "lipschitz/reach.h"

#include <cmath>
#include <utility>

#include "lipschitz/dense_kernels.h"
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
    : network_(network),
      box_(first.box_),
      bounds_(first.bounds_),
      input_magnitude_(first.input_magnitude_),
      term_magnitude_(first.term_magnitude_) {
  add_layers(around, nullptr, nullptr, decided);
}

void Reach::add_layers(const Reach* around, std::vector<MatrixXd>* slopes, std::vector<LinearForms>* forms,
                       std::vector<check::Decision>* decided) {
  const auto after_relu = [](const ReachLayer& layer, const Bounds& bounds) {
    return layer.has_relu ? VectorXd(bounds.upper.cwiseMax(0.0)) : bounds.magnitude();
  };
  for (std::size_t k = bounds_.size(); k < network_.size(); ++k) {
    const ReachLayer& layer = network_[k];
    const VectorXd magnitude = k == 0 ? largest_input(box_) : after_relu(network_[k - 1], bounds_.back());
    const Index rows = layer.weights.rows();
    input_magnitude_.push_back(magnitude);
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
    MatrixXd both = MatrixXd::Zero(2 * count, rows);
    for (Index i = 0; i < count; ++i)
      both(i, open[static_cast<std::size_t>(i)]) = 1, both(count + i, open[static_cast<std::size_t>(i)]) = -1;
    const LinearForms found = substituted(k, std::move(both));
    VectorXd ends = largest(found);
    if (decided != nullptr && k > 0 && layer.has_relu) decide(k, open, found, ends, *decided);
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
  }
}

LinearForms Reach::substituted(std::size_t top, MatrixXd lambda,
                               const std::vector<MatrixXd>* given_below) const {
  const Index rows = lambda.rows();
  VectorXd constants = VectorXd::Zero(rows);
  VectorXd absolute = VectorXd::Zero(rows);  // sum of the absolute values of all terms of `constants`
  VectorXd error = VectorXd::Zero(rows);     // what rounding of lambda may have cost
  Index terms = 8;
  for (std::size_t j = top + 1; j-- > 0;) {
    const ReachLayer& layer = network_[j];
    const MatrixXd size = lambda.cwiseAbs();
    constants += lambda * layer.bias + size * layer.bias_radius;
    absolute += size * (layer.bias.cwiseAbs() + layer.bias_radius);
    error += gamma(layer.weights.rows()) * (size * term_magnitude_[j]);
    MatrixXd next = MatrixXd::Zero(rows, layer.weights.cols());
    add_product(next, lambda, layer.weights);
    lambda = std::move(next);
    terms += 2 * layer.weights.rows() + 2 * layer.weights.cols();
    if (j == 0 || !network_[j - 1].has_relu) continue;
    for (Index i = 0; i < lambda.cols(); ++i) {
      const double l = bounds_[j - 1].lower(i);
      const double u = bounds_[j - 1].upper(i);
      if (l >= 0) continue;
      if (u <= 0) {
        lambda.col(i).setZero();
        continue;
      }
      const double slope = u / (u - l);
      const double offset = std::max({0.0, up(u - down(slope * u)), up(-slope * l)});
      const double below = u > -l ? 1.0 : 0.0;
      const double magnitude = std::max(u, -l);
      for (Index r = 0; r < rows; ++r) {
        double& v = lambda(r, i);
        if (v > 0) {
          constants(r) += v * offset;
          absolute(r) += v * offset;
          v *= slope;
          error(r) += 4 * kUnit * v * magnitude;
        } else {
          v *= given_below != nullptr ? (*given_below)[j - 1](r, i) : below;
        }
      }
    }
  }
  const double relative = 2 * static_cast<double>(terms) * kUnit;
  return {std::move(lambda),
          constants + (1 + 1e-6) * error + relative * absolute + VectorXd::Constant(rows, kUnderflow)};
}

LinearForms Reach::upper_forms(const MatrixXd& directions) const {
  return substituted(network_.size() - 1, directions);
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
  VectorXd least = direction.transpose(), most = least;
  for (std::size_t j = network_.size(); j-- > 0;) {
    const MatrixXd positive = network_[j].weights.transpose().cwiseMax(0.0);
    const MatrixXd negative = network_[j].weights.transpose().cwiseMin(0.0);
    const VectorXd below = positive * least + negative * most;
    most = positive * most + negative * least;
    least = below;
    if (j == 0 || !network_[j - 1].has_relu) continue;
    const Bounds& bounds = bounds_[j - 1];
    for (Index i = 0; i < least.size(); ++i) {
      if (bounds.lower(i) >= 0) continue;
      least(i) = bounds.upper(i) <= 0 ? 0 : std::min(0.0, least(i));
      most(i) = bounds.upper(i) <= 0 ? 0 : std::max(0.0, most(i));
    }
  }
  return least.cwiseAbs().cwiseMax(most.cwiseAbs());
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
