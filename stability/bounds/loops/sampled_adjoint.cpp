#include "stability/bounds/loops/sampled_adjoint.h"

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
  const Eigen::VectorXcd modes =
      Eigen::EigenSolver<MatrixXd>(without_unread(map_, model_, loop.plant.Ki), false).eigenvalues();
  Index slowest = 0;
  for (Index i = 0; i < modes.size(); ++i) {
    if (std::abs(modes[i]) > std::abs(modes[slowest])) slowest = i;
  }
  const double modulus = std::abs(modes[slowest]);
  if (!(modulus < 1)) return;
  double next = 1e-6;
  for (Index i = 0; i < modes.size(); ++i) {
    if (i != slowest) next = std::max(next, std::abs(modes[i]));
  }
  // Repeated modes, such as those of a delay, take some more periods to decay.
  constexpr double kMore = 60;
  const double until_gone = 42 / -std::log(std::max(modulus, 1e-6)) + kMore;
  const double until_alone = next < modulus ? 42 / std::log(modulus / next) + kMore : 1e300;
  const bool ends_alone = modes[slowest].imag() == 0 && modes[slowest].real() > 0 && until_alone < until_gone;
  const double periods = ends_alone ? until_alone : until_gone;
  if (periods > kMostPeriods) return;
  is_stable_ = true;
  periods_ = static_cast<long>(std::ceil(periods));
  if (ends_alone) ratio_ = modulus;
}

RowVectorXd SampledAdjoint::output_after_control(double phase_s) const {
  if (output_ == Output::kError) return model_.error_at(phase_s);
  return RowVectorXd::Unit(model_.size() + 1,
                           output_ == Output::kIntegral ? model_.integral_index() : model_.command_index());
}

}  // namespace swarmcert::stability
