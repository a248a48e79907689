#include "stability/bounds/loops/kernel_sum.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace swarmcert::stability {

void KernelSum::add_linear(double start, double slope, double length) {
  norms_.impulse = std::max({norms_.impulse, std::abs(start), std::abs(start + slope * length)});
  const double root = slope != 0 ? -start / slope : -1;
  if (root > 0 && root < length) {
    add_signed(start, slope, root);
    add_signed(0, slope, length - root);
  } else {
    add_signed(start, slope, length);
  }
}

void KernelSum::add_series(double jump, double start, double slope, double length, double ratio) {
  const GainNorms before = norms_;
  const double from = integral_;
  add_jump(jump);
  add_linear(start, slope, length);
  norms_.rate = before.rate + (norms_.rate - before.rate) / (1 - ratio);
  norms_.amplitude = before.amplitude + (norms_.amplitude - before.amplitude) / (1 - ratio);
  norms_.edge = std::max(norms_.edge, std::abs(from + (integral_ - from) / (1 - ratio) - at_once_));
}

void KernelSum::add_signed(double start, double slope, double length) {
  const double before = integral_;
  const double part = (start + slope * length / 2) * length;
  const double after = before + part;
  norms_.amplitude += std::abs(part);
  norms_.edge = std::max(norms_.edge, std::abs(after - at_once_));
  const auto area = [&](double u) { return (before + (start / 2 + slope * u / 6) * u) * u; };
  if (before * after < 0) {
    // The first root of before + start u + slope u^2 / 2, in the form that does not cancel: `start` is zero or has the
    // other sign than `before`.
    const double root = std::sqrt(std::max(0.0, start * start - 2 * slope * before));
    const double at = std::min(length, 2 * std::abs(before) / (std::abs(start) + root));
    norms_.rate += std::abs(area(at)) + std::abs(area(length) - area(at));
  } else {
    norms_.rate += std::abs(area(length));
  }
  integral_ = after;
}

void KernelSum::add_sample(double kernel, double period_s) {
  integral_ += kernel;
  norms_.amplitude += std::abs(kernel);
  norms_.impulse = std::max(norms_.impulse, std::abs(kernel) / period_s);
  norms_.edge = std::max(norms_.edge, std::abs(integral_ - at_once_));
  norms_.rate += std::abs(integral_) * period_s;
}

void KernelSum::add_stretch(const KernelStretch& stretch, double period_s) {
  const double at_end = integral_ + stretch.left;
  norms_.rate +=
      std::abs(stretch.area + (std::isfinite(stretch.periods) ? at_end * stretch.periods * period_s : 0));
  norms_.amplitude += std::abs(stretch.change);
  norms_.impulse = std::max(norms_.impulse, stretch.peak);
  integral_ += stretch.change;
  norms_.edge = std::max(norms_.edge, std::abs(integral_ - at_once_));
}

void KernelSum::repeat(const KernelSum& before, const KernelSum& but_last, double share, double ratio) {
  for (const auto gain : {&GainNorms::rate, &GainNorms::amplitude}) {
    const double cycle = norms_.*gain - before.norms_.*gain - share * (norms_.*gain - but_last.norms_.*gain);
    // The sum over all cycles from the first one on, of which those up to now are in the norms.
    norms_.*gain = before.norms_.*gain + cycle / (1 - ratio);
  }
}

KernelVariation force_variation(const SampledAdjoint& adjoint, const Eigen::RowVectorXd& after) {
  KernelVariation variation;
  adjoint.force_kernel(
      after, [&](double start, double slope, double length) { variation.add_linear(start, slope, length); },
      [&](double start, double slope, double length, double ratio) {
        variation.add_series(start, slope, length, ratio);
      });
  return variation;
}

namespace {

/// Sums of a kernel that is linear on each period.
struct OfForce {
  static constexpr bool kSums = true;
  static constexpr double kLongest_rad = 0.5, kLongestSwing_rad = 1e300;
  KernelSum sum;
  double period_s;

  void period(double start, double end) { sum.add_linear(start, (end - start) / period_s, period_s); }
  bool crosses_zero(double change) const { return sum.crosses_zero(change); }
  void stretch(const KernelStretch& s) { sum.add_stretch(s, period_s); }
  void rest(const KernelStretch& s) { sum.add_stretch(s, period_s); }
  void repeat(const OfForce& before, const OfForce& but_last, double share, double ratio) {
    sum.repeat(before.sum, but_last.sum, share, ratio);
  }
};

/// Sums of samples, one per period.
struct OfSamples {
  static constexpr bool kSums = true;
  static constexpr double kLongest_rad = 0.5, kLongestSwing_rad = 1e300;
  KernelSum sum;
  double period_s;

  void period(double kernel, double) { sum.add_sample(kernel, period_s); }
  bool crosses_zero(double change) const { return sum.crosses_zero(change); }
  void stretch(KernelStretch s) {
    s.peak /= period_s;
    sum.add_stretch(s, period_s);
  }
  void rest(const KernelStretch& s) { stretch(s); }
  void repeat(const OfSamples& before, const OfSamples& but_last, double share, double ratio) {
    sum.repeat(before.sum, but_last.sum, share, ratio);
  }
};

/// @param sinks of the next outputs.
template <std::size_t kLanes, class Sink>
void add_gains(const KernelWalk& walk, const Eigen::MatrixXd& outputs, std::array<Sink, kLanes> sinks,
               std::vector<GainNorms>& gains) {
  walk.run(outputs.middleRows(static_cast<Eigen::Index>(gains.size()), kLanes), sinks);
  for (const Sink& sink : sinks) gains.push_back(sink.sum.norms());
}

/// Walks for four outputs at once while there are four.
/// @param first returns the sink of an output, by its number.
template <class First>
std::vector<GainNorms> gains_of(const KernelWalk& walk, const Eigen::MatrixXd& outputs, const First& first) {
  std::vector<GainNorms> gains;
  const Eigen::Index count = outputs.rows();
  Eigen::Index i = 0;
  for (; i + 4 <= count; i += 4)
    add_gains(walk, outputs, std::array{first(i), first(i + 1), first(i + 2), first(i + 3)}, gains);
  for (; i < count; ++i) add_gains(walk, outputs, std::array{first(i)}, gains);
  return gains;
}

}  // namespace

std::vector<GainNorms> force_gains(const KernelWalk& walk, const Eigen::MatrixXd& outputs,
                                   const std::vector<double>& own_s) {
  return gains_of(walk, outputs, [&](Eigen::Index output) {
    OfForce sums = {KernelSum(), walk.period_s()};
    sums.sum.add_linear(0, 1, own_s[static_cast<std::size_t>(output)]);
    return sums;
  });
}

GainNorms force_gains(const SampledAdjoint& adjoint, const Eigen::RowVectorXd& output, double at_once) {
  const KernelWalk walk = KernelWalk::of_force(adjoint);
  return gains_of(walk, output,
                  [&](Eigen::Index) {
                    return OfForce{KernelSum(at_once), adjoint.period_s()};
                  })
      .front();
}

std::vector<GainNorms> sample_gains(const KernelWalk& walk, const Eigen::MatrixXd& outputs,
                                    const Eigen::VectorXd& own) {
  return gains_of(walk, outputs, [&](Eigen::Index output) {
    OfSamples sums = {KernelSum(), walk.period_s()};
    sums.sum.add_sample(own[output], walk.period_s());
    return sums;
  });
}

GainNorms command_gains(const SampledAdjoint& adjoint, const Eigen::RowVectorXd& output, bool with_own) {
  return input_gains(adjoint, output, adjoint.model().commanded().transpose(), with_own);
}

GainNorms input_gains(const SampledAdjoint& adjoint, const Eigen::RowVectorXd& output,
                      const Eigen::VectorXd& input, bool with_own, double at_once) {
  const KernelWalk walk = KernelWalk::of_samples(adjoint, input);
  return gains_of(walk, output,
                  [&](Eigen::Index) {
                    OfSamples sums = {KernelSum(at_once), adjoint.period_s()};
                    if (with_own) sums.sum.add_sample(output.dot(input), adjoint.period_s());
                    return sums;
                  })
      .front();
}

}  // namespace swarmcert::stability
