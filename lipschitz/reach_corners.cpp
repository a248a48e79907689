// Reach's better lower slopes: tight at the corner of the box where a form is largest.
#include <cmath>

#include "lipschitz/reach.h"

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

}  // namespace

std::vector<MatrixXd> Reach::slopes_at_corners(const MatrixXd& forms, std::size_t top) const {
  MatrixXd x(forms.cols(), forms.rows());
  for (Index row = 0; row < x.cols(); ++row)
    for (Index j = 0; j < x.rows(); ++j) {
      const auto k = static_cast<std::size_t>(j);
      x(j, row) = forms(row, j) > 0 ? box_.upper[k] : box_.lower[k];
    }
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

void Reach::decide(std::size_t k, const std::vector<Index>& open, const LinearForms& found, VectorXd& ends,
                   std::vector<check::Decision>& decided) const {
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
  const std::vector<MatrixXd> slopes = slopes_at_corners(forms, k);
  const VectorXd better = largest(substituted(k, std::move(lambda), &slopes));
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
