#include "stability/bounds/sampled_bounds.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "nn/base/doubles.h"
#include "stability/bounds/amplitude_and_rate.h"
#include "stability/bounds/loops/kernel_sum.h"

namespace swarmcert::stability {
namespace {

constexpr int kPhases = 5;

/// The kernel of one output at one phase, in consecutive cells backwards in time; per unit of force. It keeps its sign
/// on each cell.
struct Kernel {
  std::vector<double> length;
  std::vector<double> peak;       ///< largest |kernel| on a cell
  std::vector<double> step;       ///< its integral up to a cell's start, and to the end of the last cell
  std::vector<double> step_peak;  ///< largest |integral| on a cell
  std::vector<double> bend;       ///< at least int |integral - its chord| over a cell
  double area = 0;                ///< int |kernel|
  double ratio = 0;            ///< of every cell after the last to the one before; 0: nothing is left there
  double step_area_after = 0;  ///< int |integral| after the last cell

  /// Adds consecutive values of one sign, monotonic between their ends; `lowest` and `highest` are signed.
  void add_cell(double change, double duration_s, double lowest, double highest) {
    const double before = step.back();
    length.push_back(duration_s);
    peak.push_back(std::max(std::abs(lowest), std::abs(highest)));
    step.push_back(before + change);
    step_peak.push_back(std::max(std::abs(before), std::abs(step.back())));
    // Farthest from its chord is the integral of a kernel that is `highest` first and `lowest` then.
    bend.push_back((highest - lowest) * duration_s * duration_s / 8);
    area += std::abs(change);
  }

  void add(double start, double end, double duration_s) {
    if (start * end < 0) {  // the integral is extreme where the kernel is zero
      const double first_s = duration_s * start / (start - end);
      add(start, 0, first_s);
      add(0, end, duration_s - first_s);
      return;
    }
    add_cell((start + end) / 2 * duration_s, duration_s, std::min(start, end), std::max(start, end));
    bend.back() *= 2.0 / 3;  // of a parabola
  }
};

/// Fills a kernel; a sink of KernelWalk::run().
struct FillKernel {
  static constexpr bool kSums = false;
  static constexpr double kLongest_rad = 0.02, kLongestSwing_rad = 0.02;
  Kernel kernel;
  double period_s, ratio;

  void period(double start, double end) { kernel.add(start, end, period_s); }
  bool crosses_zero(double) const { return false; }
  void stretch(const KernelStretch& s) {
    const double sign = s.start < 0 ? -1 : 1;
    const double one = sign * s.peak, other = sign * s.least;
    kernel.add_cell(s.change, s.periods * period_s, std::min(one, other), std::max(one, other));
  }
  /// Adds a period, of which every later one is `ratio` times the one before; the integral decreases in proportion.
  void rest(const KernelStretch& s) {
    Kernel one;
    one.step.push_back(kernel.step.back());
    one.add(s.start, s.end, period_s);
    kernel.add_cell(one.step.back() - one.step.front(), period_s, std::min(s.start, s.end),
                    std::max(s.start, s.end));
    kernel.area += one.area / (1 - ratio) - std::abs(one.step.back() - one.step.front());
    kernel.step_peak.back() = *std::max_element(one.step_peak.begin(), one.step_peak.end());
    kernel.ratio = ratio;
    const double on_cell =
        (std::abs(one.step.front()) + std::abs(one.step.back())) / 2 * period_s + kernel.bend.back();
    kernel.step_area_after = on_cell * ratio / (1 - ratio);
  }
};

/// @param with_own whether an error of the command in the output's own period is included.
Kernel kernel_of(const SampledAdjoint& adjoint, Channel channel, double phase_s, double mass_kg,
                 bool with_own = true) {
  const double h = adjoint.period_s();
  const Eigen::RowVectorXd output = adjoint.output_after_control(phase_s) / mass_kg;
  std::array fill = {FillKernel{{}, h, adjoint.ratio()}};
  Kernel& kernel = fill[0].kernel;
  kernel.step.push_back(0);
  if (channel == Channel::kForce) {
    if (adjoint.is_error()) kernel.add(0, phase_s / mass_kg, phase_s);
    KernelWalk::of_force(adjoint).run(output, fill);
  } else {
    // An error of one period is a force held for that period, with the same int |eps| dt.
    const Eigen::VectorXd input = adjoint.model().commanded().transpose();
    const double own = output.dot(input) / h;
    if (with_own) kernel.add(own, own, h);
    KernelWalk::of_held(adjoint, input).run(output, fill);
  }
  return kernel;
}

/// Largest of `values` (one per cell) at `after_s` or earlier in time; decreases with after_s.
class FadingKernel {
 public:
  FadingKernel(const Kernel& kernel, std::vector<double> values)
      : suffix_(std::move(values)), ratio_(kernel.ratio), period_s_(kernel.length.back()) {
    for (std::size_t i = suffix_.size() - 1; i-- > 0;) suffix_[i] = std::max(suffix_[i], suffix_[i + 1]);
    double end_s = 0;
    for (const double length : kernel.length) end_s_.push_back(end_s += length);
  }
  double operator()(double after_s) const {
    const auto cell = std::upper_bound(end_s_.begin(), end_s_.end(), after_s) - end_s_.begin();
    if (static_cast<std::size_t>(cell) < suffix_.size()) return suffix_[static_cast<std::size_t>(cell)];
    const double further = std::floor((after_s - end_s_.back()) / period_s_);
    return ratio_ > 0 ? suffix_.back() * std::pow(ratio_, further) : suffix_.back();
  }

 private:
  std::vector<double> suffix_, end_s_;
  double ratio_, period_s_;
};

/// Returns the worst of `bound` over the phases at which the error may be evaluated.
template <class Bound>
double worst_phase(const SampledLoop& loop, const Bound& bound) {
  double worst = 0;
  for (int i = 0; i < kPhases; ++i) worst = std::max(worst, bound(loop.period_s * i / (kPhases - 1)));
  return worst;
}

}  // namespace

DisturbanceBounds disturbance_bounds(const SampledLoop& loop, Channel channel, const GainNorms& gains,
                                     const Disturbance& disturbance) {
  const SampledAdjoint adjoint(loop);
  const double mass_kg = loop.plant.mass_kg;
  const auto passes_felt = [&](std::vector<double> Kernel::*peak) {
    return worst_phase(loop, [&](double phase_s) {
      const Kernel kernel = kernel_of(adjoint, channel, phase_s, mass_kg);
      return felt_passes(disturbance, FadingKernel(kernel, kernel.*peak));
    });
  };
  FeltPasses felt;
  if (adjoint.is_stable()) {
    felt.impulses = [&] { return passes_felt(&Kernel::peak); };
    felt.edges = [&] { return passes_felt(&Kernel::step_peak); };
  }
  DisturbanceBounds bounds = bounds_by_class(gains, disturbance, loop.plant.Ki > 0, felt);
  if (!adjoint.is_stable()) return bounds;
  const double E = disturbance.amplitude_N, d = disturbance.rate_N_s;
  if (std::isfinite(bounds.by_rate) && std::isfinite(bounds.by_amplitude) && E > 0 && d > 0) {
    const double both = worst_phase(loop, [&](double phase_s) {
      // For the command, the rate acts once per period on the sum up to that time; the trapezoids have the same sum.
      const Kernel kernel = kernel_of(adjoint, channel, phase_s, mass_kg);
      return split_bound({kernel.step, kernel.length, kernel.bend,
                          kernel.step_area_after + 1e-12 * gains.rate, kernel.step_area_after > 0},
                         E, d);
    });
    bounds.by_both = std::min(bounds.by_both, both);
  }
  return bounds;
}

namespace {

/// Returns sup |output| at the samples, per 1/kg, due to a force of the class.
/// @param with_own as in kernel_of().
double largest_output(const SampledAdjoint& adjoint, Channel channel, double amplitude_N,
                      const Disturbance& disturbance, bool with_own) {
  const Eigen::RowVectorXd output = adjoint.output_after_control(0);
  const GainNorms gains =
      channel == Channel::kForce ? force_gains(adjoint, output) : command_gains(adjoint, output, with_own);
  const double by_amplitude = times_known(gains.amplitude, amplitude_N);
  if (!std::isfinite(disturbance.impulse_N_s)) return by_amplitude;
  double felt = gains.impulse;
  if (disturbance.passes > 1) {
    const Kernel kernel = kernel_of(adjoint, channel, 0, 1, with_own);
    felt = felt_passes(disturbance, FadingKernel(kernel, kernel.peak));
  }
  return std::min(by_amplitude, disturbance.impulse_N_s * felt);
}

}  // namespace

double effort_of_class_N(const SampledLoop& loop, Channel channel, const Disturbance& disturbance) {
  const SampledAdjoint adjoint(loop, SampledAdjoint::Output::kCommand);
  if (!adjoint.is_stable()) return kInfinity;
  const double E = disturbance.largest_N();
  return largest_output(adjoint, channel, E, disturbance, false) +
         (channel == Channel::kCommand ? std::min(E, disturbance.impulse_N_s / loop.period_s) : 0);
}

namespace {

/// The signs by which a force, held over each period, drives the command farthest; the latest period first.
std::vector<double> worst_signs(const SampledLoop& loop) {
  std::vector<double> signs;
  const SampledAdjoint adjoint(loop, SampledAdjoint::Output::kCommand);
  if (!adjoint.is_stable()) return signs;
  const auto add = [&](double start, double slope, double length) {
    signs.push_back(start + slope * length / 2 < 0 ? 1 : -1);
  };
  adjoint.force_kernel(0, add,
                       [&](double start, double slope, double length, double) { add(start, slope, length); });
  return signs;
}

/// Returns |u| at the end of such a force, with the clamp.
double command_after_N(const SampledLoop& loop, const std::vector<double>& signs, double amplitude_N,
                       double limit_m_s) {
  const SampledModel model(loop);
  const double push = amplitude_N / loop.plant.mass_kg, h = loop.period_s;
  const Eigen::Index integral = model.integral_index(), command = model.command_index();
  Eigen::VectorXd before = Eigen::VectorXd::Zero(model.size());
  const auto controlled = [&] {
    Eigen::VectorXd after = model.control() * before;
    const double excess = after[integral] - std::clamp(after[integral], -limit_m_s, limit_m_s);
    after[integral] -= excess;
    after[command] += loop.plant.Ki * excess;
    return after;
  };
  for (std::size_t k = signs.size(); k-- > 0;) {
    before = model.hold() * controlled();
    before[0] += signs[k] * push * h * h / 2;
    before[1] += signs[k] * push * h;
  }
  return loop.plant.mass_kg * std::abs(controlled()[command]);
}

}  // namespace

double effort_of_worst_force_N(const SampledLoop& loop, double amplitude_N, double limit_m_s) {
  SampledLoop without = loop;
  without.plant.Ki = 0;
  return std::max(command_after_N(loop, worst_signs(loop), amplitude_N, limit_m_s),
                  command_after_N(loop, worst_signs(without), amplitude_N, limit_m_s));
}

ClampBounds clamp_demand(const SampledLoop& loop, Channel channel, const Disturbance& disturbance,
                         const OtherErrors& other, double limit_m_s) {
  ClampBounds result;
  if (loop.plant.Ki == 0 || std::isinf(limit_m_s)) return result;
  result.exists = true;
  double demand_m_s = kInfinity;
  const SampledAdjoint integral(loop, SampledAdjoint::Output::kIntegral);
  if (integral.is_stable())
    demand_m_s =
        largest_output(integral, channel, disturbance.amplitude_N, disturbance, true) / loop.plant.mass_kg;
  result.set_demand(demand_m_s + integral_demand_m_s(loop, channel, other), limit_m_s);
  return result;
}

ClampBounds clamp_bounds(const SampledLoop& loop, Channel channel, const Disturbance& disturbance,
                         const OtherErrors& other, double limit_m_s) {
  return clamp_bounds_of(
      loop, channel, disturbance, other, limit_m_s, [&](const SampledLoop& without, const GainNorms&) {
        const SampledAdjoint adjoint(without);
        return worst_phase(without, [&](double phase_s) {
          const Kernel kernel = kernel_of(adjoint, channel, phase_s, without.plant.mass_kg);
          return felt_passes(disturbance, FadingKernel(kernel, kernel.peak));
        });
      });
}

}  // namespace swarmcert::stability
