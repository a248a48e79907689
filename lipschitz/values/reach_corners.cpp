// Reach's better lower slopes: tight at the point, mostly a corner of the box, where a form is largest.
#include <cmath>

#include "lipschitz/values/reach.h"
#include "lipschitz/values/relu_lines.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A neuron is nearly decided where its smaller end is less than this share of its range. Larger shares decide hardly
/// more.
constexpr double kNearlyDecided = 0.1;
/// How far beyond zero a neuron has to be, as a share of its range and of the terms that it sums, so that the checker's
/// rounding does not matter.
constexpr double kShareOfRange = 1e-7, kShareOfTerms = 1e-12;

/// Forms that sharpened_form() tries; each moves the slopes less. More gain little.
constexpr int kSharpened = 3;
constexpr double kShorterSteps = 0.7;

}  // namespace

MatrixXd Reach::corners(const MatrixXd& forms) const {
  MatrixXd x(forms.cols(), forms.rows());
  for (Index row = 0; row < x.cols(); ++row)
    for (Index j = 0; j < x.rows(); ++j) {
      const auto k = static_cast<std::size_t>(j);
      x(j, row) = forms(row, j) > 0 ? box_.upper[k] : box_.lower[k];
    }
  return x;
}

std::vector<MatrixXd> Reach::slopes_at(MatrixXd x, std::size_t top) const {
  std::vector<MatrixXd> slopes;
  for (std::size_t j = 0; j < top; ++j) {
    const ReachLayer& layer = network_[j];
    const MatrixXd size = (layer.weights.cwiseAbs() * x.cwiseAbs()).colwise() + layer.bias.cwiseAbs();
    x = ((layer.weights * x).colwise() + layer.bias).eval();
    slopes.emplace_back((x.array() > check::kOnAtCorner * size.array()).cast<double>().matrix().transpose());
    if (layer.has_relu) x = x.cwiseMax(0.0);
  }
  return slopes;
}

LinearForms Reach::sharpened_form(const Eigen::RowVectorXd& direction) const {
  return sharpened_form(direction, [&](const LinearForms& form) -> VectorXd { return corners(form.rows); });
}

LinearForms Reach::sharpened_form(const Eigen::RowVectorXd& direction, const Steepest& steepest) const {
  const std::size_t top = network_.size() - 1;
  const ActiveLayers layers = active_layers(top);
  LinearForms form = substituted(layers, direction), best = form;
  double least = largest(form)(0), step = 1;
  std::vector<MatrixXd> slopes;
  for (std::size_t j = 0; j < top; ++j)
    slopes.emplace_back(
        (bounds_[j].upper.array() > -bounds_[j].lower.array()).cast<double>().matrix().transpose());
  for (int tried = 0; tried < kSharpened; ++tried, step *= kShorterSteps) {
    const std::vector<MatrixXd> states = slopes_at(steepest(form), top);
    for (std::size_t j = 0; j < top; ++j) slopes[j] += step * (states[j] - slopes[j]);
    form = substituted(layers, direction, &slopes);
    const double value = largest(form)(0);
    if (value < least) least = value, best = form;
  }
  return best;
}

void Reach::decide(const ActiveLayers& layers, const std::vector<Index>& open, const LinearForms& found,
                   VectorXd& ends, std::vector<check::Decision>& decided) const {
  const std::size_t k = layers.lines.size();
  const auto count = static_cast<Index>(open.size());
  if (found.rows.cols() > check::kMostCornerInputs) return;
  std::vector<Index> near;
  for (Index i = 0; i < count; ++i) {
    const double upper = ends(i), lower = -ends(count + i), limit = kNearlyDecided * (upper - lower);
    if (!(lower < 0 && upper > 0)) continue;
    if (upper < limit) near.push_back(i);
    if (-lower < limit) near.push_back(count + i);
  }
  if (near.empty()) return;
  const auto rows = static_cast<Index>(near.size());
  MatrixXd forms(rows, found.rows.cols()), lambda = MatrixXd::Zero(rows, network_[k].weights.rows());
  for (Index n = 0; n < rows; ++n) {
    const Index row = near[static_cast<std::size_t>(n)];
    forms.row(n) = found.rows.row(row);
    lambda(n, open[static_cast<std::size_t>(row % count)]) = row < count ? 1 : -1;
  }
  const std::vector<MatrixXd> slopes = slopes_at(corners(forms), k);
  const VectorXd better = largest(substituted(layers, lambda, &slopes));
  std::size_t first = 0;
  for (std::size_t j = 0; j < k; ++j) first += static_cast<std::size_t>(network_[j].weights.rows());
  for (Index n = 0; n < rows; ++n) {
    const Index row = near[static_cast<std::size_t>(n)], i = row % count;
    const double margin = kShareOfRange * (ends(i) + ends(count + i)) +
                          kShareOfTerms * term_magnitude_[k](open[static_cast<std::size_t>(i)]);
    if (!(better(n) < -margin)) continue;
    ends(row) = better(n);
    check::Decision decision;
    decision.neuron = first + static_cast<std::size_t>(open[static_cast<std::size_t>(i)]);
    decision.is_on = row >= count;
    for (Index j = 0; j < forms.cols(); ++j)
      if (forms(n, j) > 0) decision.corner |= std::uint64_t{1} << j;
    decided.push_back(decision);
  }
}

}  // namespace swarmcert::lipschitz
