#include "stability/bounds/sampled_adjoint.h"

#include <Eigen/Dense>
#include <algorithm>

namespace swarmcert::stability {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;

MatrixXd without_row(const MatrixXd& m, Index row) {
  MatrixXd result(m.rows() - 1, m.cols());
  result.topRows(row) = m.topRows(row);
  result.bottomRows(m.rows() - 1 - row) = m.bottomRows(m.rows() - 1 - row);
  return result;
}

MatrixXd without_unread(const MatrixXd& map, const SampledModel& model, double Ki) {
  if (Ki > 0) return map;
  const MatrixXd fewer_rows = without_row(map, model.integral_index());
  return without_row(fewer_rows.transpose(), model.integral_index()).transpose();
}

double largest_modulus(const MatrixXd& map) {
  return Eigen::EigenSolver<MatrixXd>(map, false).eigenvalues().cwiseAbs().maxCoeff();
}

SampledAdjoint::SampledAdjoint(const SampledLoop& loop, Output output)
    : period_s_(loop.period_s), output_(output), model_(loop), map_(model_.hold() * model_.control()) {
  const double slowest = largest_modulus(without_unread(map_, model_, loop.plant.Ki));
  is_stable_ = slowest < 1;
  periods_ = is_stable_ ? static_cast<long>(std::ceil(42 / -std::log(std::max(slowest, 1e-6)))) + 60 : 0;
}

RowVectorXd SampledAdjoint::output_after_control(double phase_s) const {
  if (output_ == Output::kError) return model_.error_at(phase_s);
  return RowVectorXd::Unit(model_.size() + 1, model_.integral_index());
}

}  // namespace swarmcert::stability
