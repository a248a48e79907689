#include "lipschitz/values/affine_forms.h"

#include <algorithm>
#include <cmath>

#include "nn/base/doubles.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// More than what products lose to underflow.
constexpr double kLostInForms = 0x1p-900;

/// A bound on the size of each value.
VectorXd form_sizes(const AffineForms& forms) { return forms.centre.cwiseAbs() + forms.deviation(); }

}  // namespace

VectorXd AffineForms::deviation() const {
  return (1 + sum_rounding(slopes.cols())) * (slopes.cwiseAbs().rowwise().sum() + radius);
}

bool AffineForms::all_finite() const {
  return slopes.allFinite() && centre.allFinite() && radius.allFinite();
}

AffineForms forms_of(const Box& box) {
  const auto size = static_cast<Index>(box.lower.size());
  AffineForms forms{MatrixXd::Zero(size, size), VectorXd(size), VectorXd::Zero(size)};
  for (Index k = 0; k < size; ++k) {
    const double lower = box.lower[static_cast<std::size_t>(k)],
                 upper = box.upper[static_cast<std::size_t>(k)];
    const double middle = lower + (upper - lower) / 2;
    forms.centre(k) = middle;
    forms.slopes(k, k) = std::max(up(upper - middle), up(middle - lower));
  }
  return forms;
}

AffineForms layer_forms(const ReachLayer& layer, const AffineForms& inputs) {
  const MatrixXd size = layer.weights.cwiseAbs();
  AffineForms forms{layer.weights * inputs.slopes, layer.weights * inputs.centre + layer.bias,
                    size * inputs.radius + layer.bias_radius};
  // Of the centre, of every slope and of the radius: each rounds by at most so much of its own terms' sizes.
  const VectorXd terms = size * form_sizes(inputs) + layer.bias.cwiseAbs() + layer.bias_radius;
  forms.radius +=
      2 * sum_rounding(layer.weights.cols()) * terms + VectorXd::Constant(terms.size(), kLostInForms);
  return forms;
}

AffineForms relu_forms(AffineForms y, const Bounds& bounds) {
  for (Index i = 0; i < y.centre.size(); ++i) {
    const double l = bounds.lower(i), u = bounds.upper(i);
    if (l >= 0) continue;
    if (u <= 0) {
      y.slopes.row(i).setZero();
      y.centre(i) = y.radius(i) = 0;
      continue;
    }
    if (!std::isfinite(l) || !std::isfinite(u)) {
      y.radius(i) = kInfinity;
      continue;
    }
    // Any slope in [0, 1] has relu(y) >= slope y, and relu(y) - slope y is largest at one of the ends.
    const double slope = std::min(1.0, u / (u - l));
    const double gap = std::max({0.0, up(u - down(slope * u)), up(-slope * l)});
    const double rounding = sum_rounding(y.slopes.cols()) *
                            (std::abs(y.centre(i)) + y.slopes.row(i).cwiseAbs().sum() + y.radius(i) + gap);
    y.slopes.row(i) *= slope;
    y.centre(i) = slope * y.centre(i) + gap / 2;
    y.radius(i) = slope * y.radius(i) + gap / 2 + rounding + kLostInForms;
  }
  return y;
}

Bounds within(const Bounds& bounds, const AffineForms& forms) {
  Bounds result = bounds;
  const VectorXd deviation = forms.deviation();
  for (Index i = 0; i < deviation.size(); ++i) {
    result.lower(i) = std::max(result.lower(i), down(forms.centre(i) - deviation(i)));
    result.upper(i) = std::min(result.upper(i), up(forms.centre(i) + deviation(i)));
  }
  return result;
}

}  // namespace swarmcert::lipschitz
