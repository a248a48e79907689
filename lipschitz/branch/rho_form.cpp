#include "lipschitz/branch/rho_form.h"

#include <Eigen/Cholesky>

#include "lipschitz/upper/lmi_proof.h"

namespace swarmcert::lipschitz {

using Eigen::Index;
using Eigen::MatrixXd;

std::optional<RhoForm> rho_form(const std::vector<check::Matrix>& stages, const std::vector<double>& t) {
  RhoForm form;
  form.t = t;
  const std::vector<check::Dyadic> exact_t(t.begin(), t.end());
  const int inputs = stages.front().cols;
  const check::Matrix without = check::quadratic_lmi(stages, check::Matrix(inputs, inputs), exact_t);
  std::vector<Index> live;  // rows of neurons with a positive multiplier; the other rows are zero
  for (int i = inputs; i < without.rows; ++i)
    if (without(i, i).sign() > 0) live.push_back(i);
  const auto size = static_cast<Index>(live.size());
  MatrixXd inner(size, size), edge(size, inputs);
  for (Index i = 0; i < size; ++i) {
    const int row = static_cast<int>(live[static_cast<std::size_t>(i)]);
    for (Index j = 0; j < size; ++j)
      inner(i, j) = to_double(without(row, static_cast<int>(live[static_cast<std::size_t>(j)])));
    for (int j = 0; j < inputs; ++j) edge(i, j) = to_double(without(row, j));
  }
  const Eigen::LLT<MatrixXd> factor(inner);
  if (factor.info() != Eigen::Success) return std::nullopt;
  const MatrixXd half = factor.matrixL().solve(edge);
  const MatrixXd least = half.transpose() * half;
  for (double slack = 1e-9; slack < 1e-3; slack *= 10) {
    form.q = least;
    form.q.diagonal().array() += slack * least.trace();
    check::Matrix exact(inputs, inputs);
    for (int i = 0; i < inputs; ++i)
      for (int j = 0; j <= i; ++j) {
        form.q(j, i) = form.q(i, j);
        exact(i, j) = exact(j, i) = check::Dyadic(form.q(i, j));
      }
    std::optional<check::Factor> proof = check::proposed_factor(check::quadratic_lmi(stages, exact, exact_t));
    if (!proof) continue;
    form.factor = std::move(*proof);
    return form;
  }
  return std::nullopt;
}

}  // namespace swarmcert::lipschitz
