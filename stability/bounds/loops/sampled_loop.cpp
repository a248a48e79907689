#include "stability/bounds/loops/sampled_loop.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

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

/// Gains to e at a phase of the period, per unit of acceleration or of the estimate's error.
struct AtPhase {
  double phase_s = 0;
  GainNorms gains;
};

/// Computes them for phases of the period, several at once.
class PhaseGains {
 public:
  PhaseGains(const SampledLoop& loop, Channel channel) : adjoint_(loop) {
    const SampledModel& model = adjoint_.model();
    if (channel == Channel::kCommand) input_ = model.commanded().transpose();
    prepare();
  }
  PhaseGains(const SampledLoop& loop, Estimate estimate) : adjoint_(loop) {
    const SampledModel& model = adjoint_.model();
    input_ = estimate == Estimate::kPosition ? model.measured_position() : model.measured_velocity();
    prepare();
  }

  bool stable() const { return adjoint_.is_stable(); }
  std::vector<AtPhase> at(const std::vector<double>& phases_s) const {
    MatrixXd outputs(phases_s.size(), adjoint_.model().size() + 1);
    for (std::size_t i = 0; i < phases_s.size(); ++i)
      outputs.row(static_cast<Index>(i)) = adjoint_.output_after_control(phases_s[i]);
    const std::vector<GainNorms> gains = input_.size() > 0 ? sample_gains(*walk_, outputs, outputs * input_)
                                                           : force_gains(*walk_, outputs, phases_s);
    std::vector<AtPhase> result;
    for (std::size_t i = 0; i < gains.size(); ++i) result.push_back({phases_s[i], gains[i]});
    return result;
  }

 private:
  void prepare() {
    if (!stable()) return;
    walk_ = input_.size() > 0 ? KernelWalk::of_samples(adjoint_, input_) : KernelWalk::of_force(adjoint_);
  }

  SampledAdjoint adjoint_;
  Eigen::VectorXd input_;  ///< added to the state after control, once per period; empty: a force
  std::optional<KernelWalk> walk_;
};

/// The vertex of the parabola through the largest value of one gain and its neighbours.
struct Vertex {
  double phase_s = 0, gain = 0;
};

/// @param known in the order of their phases; the last one is followed by the first one of the next period.
Vertex vertex_of(const std::vector<AtPhase>& known, double GainNorms::*which, double period_s) {
  const auto best = std::max_element(known.begin(), known.end(), [which](const AtPhase& a, const AtPhase& b) {
    return a.gains.*which < b.gains.*which;
  });
  const AtPhase& before = best == known.begin() ? known.back() : *(best - 1);
  const AtPhase& after = best + 1 == known.end() ? known.front() : *(best + 1);
  const double middle_s = best->phase_s, middle = best->gains.*which;
  const double back_s = std::fmod(middle_s - before.phase_s + period_s, period_s);
  const double ahead_s = std::fmod(after.phase_s - middle_s + period_s, period_s);
  const double fall_back = middle - before.gains.*which, fall_ahead = middle - after.gains.*which;
  const double bend = (fall_back * ahead_s + fall_ahead * back_s) / (back_s * ahead_s * (back_s + ahead_s));
  if (!(bend > 0)) return {middle_s, middle};
  const double slope = fall_back / back_s - bend * back_s;
  const double offset_s = slope / bend / 2;
  return {std::fmod(middle_s + offset_s + period_s, period_s), middle + slope * offset_s / 2};
}

/// Returns the largest gains over the phases. The end of a period is the start of the next one.
GainNorms norms_over(const PhaseGains& gains, double period_s, Instants instants) {
  if (!gains.stable()) return {kInfinity, kInfinity, kInfinity, kInfinity};
  if (instants == Instants::kSampling) return gains.at({0}).front().gains;
  constexpr int kPhases = 8, kMostRefinements = 3;
  constexpr double kResolved = 1e-10;
  std::vector<double> phases_s;
  for (int i = 0; i < kPhases; ++i) phases_s.push_back(i * period_s / kPhases);
  std::vector<AtPhase> known = gains.at(phases_s);
  bool is_resolved = false;
  for (int i = 0; i < kMostRefinements && !is_resolved; ++i) {
    std::vector<double> expected;
    phases_s.clear();
    for (const auto which : kAllGains) {
      const Vertex vertex = vertex_of(known, which, period_s);
      phases_s.push_back(vertex.phase_s);
      expected.push_back(vertex.gain);
    }
    is_resolved = true;
    const std::vector<AtPhase> found = gains.at(phases_s);
    for (std::size_t k = 0; k < found.size(); ++k) {
      const double gain = found[k].gains.*kAllGains[k];
      is_resolved = is_resolved && !(std::abs(gain - expected[k]) > kResolved * gain);
      const auto place =
          std::lower_bound(known.begin(), known.end(), found[k].phase_s,
                           [](const AtPhase& a, double phase_s) { return a.phase_s < phase_s; });
      if (place == known.end() || place->phase_s != found[k].phase_s) known.insert(place, found[k]);
    }
  }
  GainNorms result;
  for (const AtPhase& one : known) {
    for (const auto which : kAllGains) result.*which = std::max(result.*which, one.gains.*which);
  }
  return result;
}

}  // namespace

double effective_Ki(const SampledLoop& loop) {
  return loop.plant.Ki * loop.integrator_step_s / loop.period_s;
}

double spectral_radius(const SampledLoop& loop) {
  const SampledModel model(loop);
  return largest_modulus(model.map());
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
  const MatrixXd map = model.map();
  if (!(largest_modulus(map) < 1)) return {kInfinity, kInfinity};
  // Noise enters where the control reads e and e': the columns of control() minus the identity part of the state.
  MatrixXd read = model.control().leftCols(2);
  read(0, 0) -= 1;
  read(1, 1) -= 1;
  read.col(0) *= position_m;
  read.col(1) *= velocity_m_s;
  const MatrixXd noise = model.hold() * read;
  // P = map P map' + noise noise', by doubling: P_2k = P_k + M^k P_k M^k'.
  MatrixXd covariance = noise * noise.transpose();
  MatrixXd power = map;
  for (int i = 0; i < 40; ++i) {
    covariance = (covariance + power * covariance * power.transpose()).eval();
    power = (power * power).eval();
  }
  const Index u = model.command_index();
  const RowVectorXd command = model.control().row(u);
  const double variance = (command * covariance * command.transpose())(0, 0) + read.row(u).squaredNorm();
  return {std::sqrt(covariance(0, 0)), std::sqrt(variance)};
}

}  // namespace swarmcert::stability
