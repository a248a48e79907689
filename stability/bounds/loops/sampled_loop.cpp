#include "stability/bounds/loops/sampled_loop.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

#include "nn/base/doubles.h"
#include "stability/bounds/loops/kernel_sum.h"
#include "stability/bounds/loops/sampled_adjoint.h"
#include "stability/bounds/loops/sampled_model.h"

namespace swarmcert::stability {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;

constexpr std::array<double GainNorms::*, 4> kAllGains = {&GainNorms::rate, &GainNorms::amplitude,
                                                          &GainNorms::edge, &GainNorms::impulse};

/// Gains to e at one phase of the period, per unit of acceleration or of the estimate's error.
class PhaseGains {
 public:
  PhaseGains(const SampledLoop& loop, Channel channel) : adjoint_(loop) {
    const SampledModel& model = adjoint_.model();
    if (channel == Channel::kCommand) input_ = Eigen::VectorXd::Unit(model.size() + 1, model.command_index());
  }
  PhaseGains(const SampledLoop& loop, Estimate estimate) : adjoint_(loop) {
    const SampledModel& model = adjoint_.model();
    input_ = estimate == Estimate::kPosition ? model.measured_position() : model.measured_velocity();
  }

  bool stable() const { return adjoint_.is_stable(); }

  GainNorms at(double phase_s) const {
    const RowVectorXd after = adjoint_.output_after_control(phase_s);
    if (input_.size() > 0) return input_gains(adjoint_, after, input_);
    KernelSum sum;
    sum.add_linear(0, 1, phase_s);
    add_force_kernel(adjoint_, after, sum);
    return sum.norms();
  }

 private:
  SampledAdjoint adjoint_;
  Eigen::VectorXd input_;  ///< added to the state after control, once per period; empty: a force
};

/// Returns the largest value of one gain over the phases: golden section around the best value on a grid.
double refine(const PhaseGains& gains, double GainNorms::*which, const std::vector<GainNorms>& grid,
              double step_s) {
  std::size_t best = 0;
  for (std::size_t i = 1; i < grid.size(); ++i) {
    if (grid[i].*which > grid[best].*which) best = i;
  }
  double low = best == 0 ? 0 : static_cast<double>(best - 1) * step_s;
  double high = std::min(static_cast<double>(best + 1), static_cast<double>(grid.size() - 1)) * step_s;
  double result = grid[best].*which;
  constexpr double kGolden = 0.6180339887498949;
  double a = high - kGolden * (high - low);
  double b = low + kGolden * (high - low);
  double at_a = gains.at(a).*which;
  double at_b = gains.at(b).*which;
  for (int i = 0; i < 12; ++i) {
    result = std::max({result, at_a, at_b});
    if (at_a > at_b) {
      high = b, b = a, at_b = at_a;
      a = high - kGolden * (high - low);
      at_a = gains.at(a).*which;
    } else {
      low = a, a = b, at_a = at_b;
      b = low + kGolden * (high - low);
      at_b = gains.at(b).*which;
    }
  }
  return std::max({result, at_a, at_b});
}

GainNorms norms_over(const PhaseGains& gains, double period_s, Instants instants) {
  if (!gains.stable()) return {kInfinity, kInfinity, kInfinity, kInfinity};
  if (instants == Instants::kSampling) return gains.at(0);
  constexpr int kPhaseSteps = 9;
  const double step_s = period_s / (kPhaseSteps - 1);
  std::vector<GainNorms> grid;
  for (int i = 0; i < kPhaseSteps; ++i) grid.push_back(gains.at(i * step_s));
  GainNorms result;
  for (const auto which : kAllGains) result.*which = refine(gains, which, grid, step_s);
  return result;
}

}  // namespace

double effective_Ki(const SampledLoop& loop) {
  return loop.plant.Ki * loop.integrator_step_s / loop.period_s;
}

double spectral_radius(const SampledLoop& loop) {
  const SampledModel model(loop);
  return largest_modulus(without_unread(model.hold() * model.control(), model, loop.plant.Ki));
}

GainNorms sampled_norms(const SampledLoop& loop, Channel channel, Instants instants) {
  GainNorms result = norms_over(PhaseGains(loop, channel), loop.period_s, instants);
  for (const auto which : kAllGains) result.*which /= loop.plant.mass_kg;
  if (loop.plant.Ki == 0) result.rate = kInfinity;
  return result;
}

GainNorms sampled_norms(const SampledLoop& loop, Estimate estimate, Instants instants) {
  GainNorms result = norms_over(PhaseGains(loop, estimate), loop.period_s, instants);
  if (loop.plant.Ki == 0 || estimate == Estimate::kPosition) result.rate = kInfinity;
  return result;
}

NoiseDeviation noise_deviation(const SampledLoop& loop, double position_m, double velocity_m_s) {
  const SampledModel model(loop);
  const double Ki = loop.plant.Ki;
  const MatrixXd map = without_unread(model.hold() * model.control(), model, Ki);
  if (!(largest_modulus(map) < 1)) return {kInfinity, kInfinity};
  // Noise enters where the control reads e and e': the columns of control() minus the identity part of the state.
  MatrixXd read = model.control().leftCols(2);
  read(0, 0) -= 1;
  read(1, 1) -= 1;
  read.col(0) *= position_m;
  read.col(1) *= velocity_m_s;
  MatrixXd noise = model.hold() * read;
  if (Ki == 0) noise = without_row(noise, model.integral_index());
  // P = map P map' + noise noise', by doubling: P_2k = P_k + M^k P_k M^k'.
  MatrixXd covariance = noise * noise.transpose();
  MatrixXd power = map;
  for (int i = 0; i < 40; ++i) {
    covariance = (covariance + power * covariance * power.transpose()).eval();
    power = (power * power).eval();
  }
  const Index u = model.command_index();
  RowVectorXd command = model.control().row(u);
  if (Ki == 0) command = without_row(command.transpose(), model.integral_index()).transpose();
  const double variance = (command * covariance * command.transpose())(0, 0) + read.row(u).squaredNorm();
  return {std::sqrt(covariance(0, 0)), std::sqrt(variance)};
}

}  // namespace swarmcert::stability
