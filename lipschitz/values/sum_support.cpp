#include "lipschitz/values/sum_support.h"

#include <cmath>

#include "nn/base/doubles.h"

namespace swarmcert::lipschitz {
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

double sum_rounded_up(double constant, int count, double term) {
  // One product and one addition, each off by at most half a unit of its result.
  const double total = constant + count * term;
  return up(total + 0x1p-50 * (std::abs(total) + std::abs(constant) + std::abs(count * term)) + 1e-300);
}

VectorXd SumSupport::operator()(const LinearForms& forms) const {
  VectorXd result = forms.constants;
  for (const Term& term : terms) {
    if (term.count == 0) continue;
    const VectorXd largest = term.tree->largest(forms.rows, search).upper;
    for (Index i = 0; i < result.size(); ++i) {
      result(i) = sum_rounded_up(result(i), term.count, largest(i));
      if (std::isnan(result(i))) result(i) = kInfinity;
    }
  }
  return result;
}

Bounds SumSupport::bounds() const {
  LinearForms both{MatrixXd(2 * size, size), VectorXd::Zero(2 * size)};
  both.rows << MatrixXd::Identity(size, size), -MatrixXd::Identity(size, size);
  const VectorXd found = (*this)(both);
  return {-found.tail(size), found.head(size)};
}

std::vector<VectorXd> SumSupport::steepest(const Eigen::RowVectorXd& form) const {
  std::vector<VectorXd> points;
  for (const Term& term : terms) points.emplace_back(term.tree->largest(form, search).x.col(0));
  return points;
}

}  // namespace swarmcert::lipschitz
