#include "lipschitz/sum_support.h"

#include <cmath>

#include "nn/base/doubles.h"
#include "nn/base/parallel.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// [a] + [b], rounded outwards.
Bounds sum(const Bounds& a, const Bounds& b) {
  Bounds result{a.lower + b.lower, a.upper + b.upper};
  for (double& x : result.lower) x = down(x);
  for (double& x : result.upper) x = up(x);
  return result;
}

/// The largest values of rows y over all parts.
VectorXd largest_over(const std::vector<std::shared_ptr<const Reach>>& parts, const MatrixXd& rows,
                      int jobs) {
  std::vector<VectorXd> found(parts.size());
  files::parallel_for(static_cast<int>(parts.size()), jobs, [&](int index) {
    const Reach& part = *parts[static_cast<std::size_t>(index)];
    found[static_cast<std::size_t>(index)] = part.largest(part.upper_forms(rows));
  });
  VectorXd result = VectorXd::Constant(rows.rows(), -kInfinity);
  for (const VectorXd& one : found) result = result.cwiseMax(one);
  return result;
}

}  // namespace

double sum_rounded_up(double constant, int count, double term) {
  // One product and one addition, each off by at most half a unit of its result.
  const double total = constant + count * term;
  return up(total + 0x1p-50 * (std::abs(total) + std::abs(constant) + std::abs(count * term)) + 1e-300);
}

Bounds SumSupport::bounds() const {
  Bounds result{VectorXd::Zero(size), VectorXd::Zero(size)};
  for (const Term& term : terms)
    for (int j = 0; j < term.count; ++j) result = sum(result, term.hull->bounds);
  return result;
}

VectorXd SumSupport::operator()(const LinearForms& forms) const {
  VectorXd result = forms.constants;
  for (const Term& term : terms) {
    if (term.count == 0) continue;
    const VectorXd largest = largest_over(term.hull->parts, forms.rows, jobs);
    for (Index i = 0; i < result.size(); ++i) {
      result(i) = sum_rounded_up(result(i), term.count, largest(i));
      if (std::isnan(result(i))) result(i) = kInfinity;
    }
  }
  return result;
}

}  // namespace swarmcert::lipschitz
