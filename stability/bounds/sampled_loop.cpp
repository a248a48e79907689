#include "stability/bounds/sampled_loop.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "stability/bounds/sampled_adjoint.h"
#include "stability/bounds/sampled_model.h"

namespace swarmcert::stability {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::array<double GainNorms::*, 4> kAllGains = {&GainNorms::rate, &GainNorms::amplitude,
                                                          &GainNorms::edge, &GainNorms::impulse};

/// Adds up |kernel|, |its integral| and their extrema backwards in time from the moment looked at.
class KernelSum {
 public:
  /// A stretch of `length` on which the kernel is slope u + start, u growing backwards in time.
  void add_linear(double start, double slope, double length) {
    norms_.impulse = std::max({norms_.impulse, std::abs(start), std::abs(start + slope * length)});
    const double root = slope != 0 ? -start / slope : -1;
    if (root > 0 && root < length) {
      add_signed(start, slope, root);
      add_signed(0, slope, length - root);
    } else {
      add_signed(start, slope, length);
    }
  }

  /// That stretch, then again and again `ratio` times smaller; the integral, too, falls in proportion.
  void add_series(double start, double slope, double length, double ratio) {
    const GainNorms before = norms_;
    add_linear(start, slope, length);
    norms_.rate = before.rate + (norms_.rate - before.rate) / (1 - ratio);
    norms_.amplitude = before.amplitude + (norms_.amplitude - before.amplitude) / (1 - ratio);
  }

  const GainNorms& norms() const { return norms_; }

 private:
  /// No change of sign of the kernel inside, so its integral is monotonic and has at most one zero.
  void add_signed(double start, double slope, double length) {
    const double before = integral_;
    const double part = (start + slope * length / 2) * length;
    const double after = before + part;
    norms_.amplitude += std::abs(part);
    norms_.edge = std::max(norms_.edge, std::abs(after));
    const auto area = [&](double u) { return (before + (start / 2 + slope * u / 6) * u) * u; };
    if (before * after < 0) {
      double from = 0;
      double to = length;
      for (int i = 0; i < 60; ++i) {  // the quadratic formula cancels where slope is tiny
        const double middle = (from + to) / 2;
        const double here = before + (start + slope * middle / 2) * middle;
        (here * before > 0 ? from : to) = middle;
      }
      norms_.rate += std::abs(area(from)) + std::abs(area(length) - area(from));
    } else {
      norms_.rate += std::abs(area(length));
    }
    integral_ = after;
  }

  GainNorms norms_;
  double integral_ = 0;
};

/// Gains to e at one phase of the period; per unit of acceleration.
class PhaseGains {
 public:
  PhaseGains(const SampledLoop& loop, Channel channel) : channel_(channel), adjoint_(loop) {}

  bool stable() const { return adjoint_.is_stable(); }

  GainNorms at(double phase_s) const {
    const double period_s = adjoint_.period_s();
    if (channel_ == Channel::kForce) {
      KernelSum force;
      adjoint_.force_kernel(
          phase_s, [&](double start, double slope, double length) { force.add_linear(start, slope, length); },
          [&](double start, double slope, double length, double ratio) {
            force.add_series(start, slope, length, ratio);
          });
      return force.norms();
    }
    GainNorms command;
    double step = 0;
    const auto add = [&](double kernel) {
      step += kernel;
      command.amplitude += std::abs(kernel);
      command.impulse = std::max(command.impulse, std::abs(kernel) / period_s);
      command.edge = std::max(command.edge, std::abs(step));
      command.rate += std::abs(step) * period_s;
    };
    adjoint_.command_kernel(phase_s, add, [&](double kernel, double ratio) {
      // The step returns to zero in proportion to the kernel.
      const double rate = command.rate;
      const double amplitude = command.amplitude;
      add(kernel);
      command.rate = rate + (command.rate - rate) / (1 - ratio);
      command.amplitude = amplitude + (command.amplitude - amplitude) / (1 - ratio);
    });
    return command;
  }

 private:
  Channel channel_;
  SampledAdjoint adjoint_;
};

/// The largest value of one gain over the phases, from its values on a grid: golden section around the best.
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

}  // namespace

double effective_Ki(const SampledLoop& loop) {
  return loop.plant.Ki * loop.integrator_step_s / loop.period_s;
}

double spectral_radius(const SampledLoop& loop) {
  const SampledModel model(loop);
  return largest_modulus(without_unread(model.hold() * model.control(), model, loop.plant.Ki));
}

GainNorms sampled_norms(const SampledLoop& loop, Channel channel, Instants instants) {
  const PhaseGains gains(loop, channel);
  if (!gains.stable()) return {kInfinity, kInfinity, kInfinity, kInfinity};
  if (instants == Instants::kSampling) {
    GainNorms at_samples = gains.at(0);
    for (const auto which : kAllGains) at_samples.*which /= loop.plant.mass_kg;
    if (loop.plant.Ki == 0) at_samples.rate = kInfinity;
    return at_samples;
  }
  constexpr int kPhases = 9;
  const double step_s = loop.period_s / (kPhases - 1);
  std::vector<GainNorms> grid;
  for (int i = 0; i < kPhases; ++i) grid.push_back(gains.at(i * step_s));
  GainNorms result;
  for (const auto which : kAllGains) result.*which = refine(gains, which, grid, step_s) / loop.plant.mass_kg;
  if (loop.plant.Ki == 0) result.rate = kInfinity;
  return result;
}

NoiseDeviation noise_deviation(const SampledLoop& loop, double position_m, double velocity_m_s) {
  const SampledModel model(loop);
  const double Ki = loop.plant.Ki;
  const MatrixXd map = without_unread(model.hold() * model.control(), model, Ki);
  if (!(largest_modulus(map) < 1)) return {kInfinity, kInfinity};
  // Noise enters where the control reads e and e': the columns of control() less what is the state itself.
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
