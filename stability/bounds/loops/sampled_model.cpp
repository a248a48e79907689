#include "stability/bounds/loops/sampled_model.h"

#include <cmath>
#include <vector>

namespace swarmcert::stability {

using Eigen::Index;
using Eigen::MatrixXd;

MatrixXd exponential(const MatrixXd& At) {
  const double norm = At.cwiseAbs().rowwise().sum().maxCoeff();
  const int halvings = norm > 0.25 ? static_cast<int>(std::ceil(std::log2(norm / 0.25))) : 0;
  const MatrixXd scaled = At * std::ldexp(1.0, -halvings);
  MatrixXd term = MatrixXd::Identity(At.rows(), At.cols());
  MatrixXd result = term;
  for (int k = 1; k <= 16; ++k) {
    term = (term * scaled / k).eval();
    result += term;
  }
  for (int i = 0; i < halvings; ++i) result = (result * result).eval();
  return result;
}

SampledModel::SampledModel(const SampledLoop& loop) : loop_(loop) {
  std::vector<double> lags_s;
  for (const double tau : loop.plant.lags_s) {
    if (tau > 0) lags_s.push_back(tau);
  }
  const auto lags = static_cast<Index>(lags_s.size());
  plant_ = 2 + lags;
  const double periods = loop.plant.delay_s / loop.period_s;
  double whole = std::floor(periods + 1e-9);
  shift_s_ = loop.plant.delay_s - whole * loop.period_s;
  if (shift_s_ < 1e-9 * loop.period_s) shift_s_ = 0;
  newest_ = static_cast<Index>(whole);
  past_ = newest_ + (shift_s_ > 0 ? 1 : 0);

  generator_ = MatrixXd::Zero(plant_ + 1, plant_ + 1);
  generator_(0, 1) = 1;
  generator_(1, 2) = 1;  // the last lag's output, or the command itself without a lag
  for (Index i = 0; i < lags; ++i) {
    const double tau = lags_s[static_cast<std::size_t>(i)];
    generator_(2 + i, 2 + i) = -1 / tau;
    generator_(2 + i, 3 + i) = 1 / tau;
  }

  control_ = MatrixXd::Zero(size() + 1, size());
  control_.topLeftCorner(plant_ + 1, plant_ + 1).setIdentity();
  control_(plant_, 0) = loop.integrator_step_s;
  control_(command_index(), 0) = -(loop.plant.Kp + loop.plant.Ki * loop.integrator_step_s);
  control_(command_index(), 1) = -loop.plant.Kd;
  control_(command_index(), plant_) = -loop.plant.Ki;
  for (Index i = 0; i < past_; ++i) control_(command_index() + 1 + i, command_index() + i) = 1;

  hold_ = MatrixXd::Zero(size(), size() + 1);
  hold_.topRows(plant_) = plant_at(loop.period_s);
  hold_(plant_, plant_) = 1;
  for (Index i = 0; i < past_; ++i) hold_(plant_ + 1 + i, command_index() + i) = 1;
}

MatrixXd SampledModel::map() const {
  MatrixXd result = hold_ * control_;
  if (loop_.plant.Ki == 0) {
    result.row(integral_index()).setZero();
    result.col(integral_index()).setZero();
  }
  return result;
}

MatrixXd SampledModel::plant_step(double duration_s) const {
  return exponential(generator_ * duration_s).topRows(plant_);
}

MatrixXd SampledModel::plant_at(double phase_s) const {
  MatrixXd result = MatrixXd::Zero(plant_, size() + 1);
  const double first_s = std::min(phase_s, shift_s_);
  result.leftCols(plant_).setIdentity();
  const auto advance = [&](double duration_s, Index command) {
    const MatrixXd step = plant_step(duration_s);
    result = (step.leftCols(plant_) * result).eval();
    result.col(command_index() + command) += step.col(plant_);
  };
  if (first_s > 0) advance(first_s, newest_ + 1);
  if (phase_s > first_s) advance(phase_s - first_s, newest_);
  return result;
}

Eigen::RowVectorXd SampledModel::error_at(double phase_s) const { return plant_at(phase_s).row(0); }

}  // namespace swarmcert::stability
