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
  const Index turning =
      loop.attitude ? 2 + (loop.body_rate_lag_s > 0 ? 1 : 0) + (loop.attitude->KI_J_s3 > 0 ? 1 : 0) : 0;
  plant_ = 2 + turning + lags;
  const double periods = loop.plant.delay_s / loop.period_s;
  double whole = std::floor(periods + 1e-9);
  shift_s_ = loop.plant.delay_s - whole * loop.period_s;
  if (shift_s_ < 1e-9 * loop.period_s) shift_s_ = 0;
  newest_ = static_cast<Index>(whole);
  past_ = newest_ + (shift_s_ > 0 ? 1 : 0);

  generator_ = MatrixXd::Zero(plant_ + 1, plant_ + 1);
  generator_(0, 1) = 1;
  // The last lag's output, or the tilt; the command itself without either.
  generator_(1, 2) = 1;
  const Index lag = 2 + turning;
  for (Index i = 0; i < lags; ++i) {
    const double tau = lags_s[static_cast<std::size_t>(i)];
    generator_(lag + i, lag + i) = -1 / tau;
    generator_(lag + i, lag + i + 1) = 1 / tau;
  }
  if (loop.attitude) add_attitude(lag, lag + lags);

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

void SampledModel::add_attitude(Index torque, Index command) {
  constexpr Index kTilt = 2, kRate = 3;  // of g theta and g theta'
  const AttitudeLoop& law = *loop_.attitude;
  MatrixXd angular_acceleration = MatrixXd::Zero(1, generator_.cols());
  angular_acceleration(0, command) = law.KR_J_s2;
  angular_acceleration(0, kTilt) = -law.KR_J_s2;
  generator_(kTilt, kRate) = 1;
  Index next = kRate + 1, measured_rate = kRate;
  if (loop_.body_rate_lag_s > 0) {
    measured_rate = next++;
    generator_(measured_rate, kRate) = 1 / loop_.body_rate_lag_s;
    generator_(measured_rate, measured_rate) = -1 / loop_.body_rate_lag_s;
  }
  angular_acceleration(0, measured_rate) = -law.Kw_J_s;
  if (law.KI_J_s3 > 0) {  // of the integral of theta - theta_c
    generator_(next, kTilt) = 1;
    generator_(next, command) = -1;
    angular_acceleration(0, next) = -law.KI_J_s3;
  }
  if (torque == command) {
    generator_.row(kRate) = angular_acceleration;
    return;
  }
  // Behind the lags, of which the first one reads the law in place of the command.
  generator_(kRate, torque) = 1;
  const double rate = generator_(command - 1, command);
  generator_(command - 1, command) = 0;
  generator_.row(command - 1) += rate * angular_acceleration;
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
