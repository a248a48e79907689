#include "lipschitz/reach.h"

#include <cmath>
#include <memory>
#include <queue>

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
      const double offset = std::max({0.0, next_up(u - next_down(slope * u)), next_up(-slope * l)});
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
  for (double& x : result) x = std::isnan(x) ? kInfinity : next_up(x);
  return result;
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

Maximum maximise(const ReachNetwork& network, const Eigen::RowVectorXd& direction, const Box& box,
                 int nodes) {
  struct Node {
    double upper;
    std::shared_ptr<const Reach> reach;
    VectorXd gain;  ///< per dimension: what its width may cost
    bool operator<(const Node& other) const { return upper < other.upper; }
  };
  Maximum best;
  best.value = -kInfinity;
  const auto node_at = [&](const Box& part, const Reach* around) {
    auto reach = std::make_shared<const Reach>(network, part, around);
    const LinearForms form = reach->upper_forms(direction);
    const VectorXd lower = side(part.lower);
    const VectorXd upper = side(part.upper);
    VectorXd vertex = lower;
    for (Index i = 0; i < vertex.size(); ++i)
      if (form.rows(0, i) > 0) vertex(i) = upper(i);
    for (const VectorXd& x : {vertex, VectorXd((lower + upper) / 2)}) {
      const double value = direction.dot(evaluate_roughly(network, x));
      if (value > best.value) best.value = value, best.x = x;
    }
    // The form tells how the value changes along a dimension; the width keeps dimensions alive that it does not see.
    const VectorXd gain =
        (form.rows.row(0).transpose().cwiseAbs().array() + 1e-3 * form.rows.cwiseAbs().maxCoeff()) *
        (upper - lower).array();
    ++best.nodes;
    return Node{reach->largest(form)(0), std::move(reach), gain};
  };
  std::priority_queue<Node> queue;
  queue.push(node_at(box, nullptr));
  while (best.nodes + 2 <= nodes) {
    const Node top = queue.top();
    if (!(top.upper > best.value + 1e-6 * std::abs(best.value))) break;
    Index k = 0;
    if (!(top.gain.maxCoeff(&k) > 0)) break;
    queue.pop();
    const auto [first, second] = halves(top.reach->box(), k);
    for (const Box& part : {first, second}) {
      Node child = node_at(part, top.reach.get());
      child.upper = std::min(child.upper, top.upper);
      queue.push(std::move(child));
    }
  }
  best.upper = queue.top().upper;
  return best;
}

Hull hull(const ReachNetwork& network, const Box& box, int nodes) {
  struct Part {
    double norm;
    std::shared_ptr<const Reach> reach;
    bool operator<(const Part& other) const { return norm < other.norm; }
  };
  const auto part_of = [&](const Box& part, const Reach* around) {
    auto reach = std::make_shared<const Reach>(network, part, around);
    const double norm = (1 + 1e-9) * reach->output().magnitude().norm();
    return Part{std::isnan(norm) ? kInfinity : norm, std::move(reach)};
  };
  std::priority_queue<Part> queue;
  queue.push(part_of(box, nullptr));
  for (int done = 1; done + 2 <= nodes; done += 2) {
    const Part top = queue.top();
    const VectorXd widths = side(top.reach->box().upper) - side(top.reach->box().lower);
    Index k = 0;
    // Widths relative to the whole box, so that units do not matter.
    const VectorXd whole = (side(box.upper) - side(box.lower)).cwiseMax(1e-300);
    if (!(widths.cwiseQuotient(whole).maxCoeff(&k) > 0)) break;
    queue.pop();
    const auto [first, second] = halves(top.reach->box(), k);
    for (const Box& piece : {first, second}) queue.push(part_of(piece, top.reach.get()));
  }
  Hull result{queue.top().reach->output(), queue.top().norm};
  for (; !queue.empty(); queue.pop()) {
    const Bounds& bounds = queue.top().reach->output();
    result.bounds.lower = result.bounds.lower.cwiseMin(bounds.lower);
    result.bounds.upper = result.bounds.upper.cwiseMax(bounds.upper);
  }
  return result;
}

}  // namespace swarmcert::lipschitz
