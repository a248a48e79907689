#include "stability/bounds/loops/kernel_sum.h"

#include <algorithm>
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
    double from = 0;
    double to = length;
    for (int i = 0; i < 60; ++i) {  // the quadratic formula cancels if the slope is tiny
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

GainNorms command_gains(const SampledAdjoint& adjoint, const Eigen::RowVectorXd& after, bool with_own) {
  const SampledModel& model = adjoint.model();
  return input_gains(adjoint, after, Eigen::VectorXd::Unit(model.size() + 1, model.command_index()),
                     with_own);
}

GainNorms input_gains(const SampledAdjoint& adjoint, const Eigen::RowVectorXd& after,
                      const Eigen::VectorXd& input, bool with_own, double at_once) {
  const double period_s = adjoint.period_s();
  GainNorms gains;
  double step = 0;
  bool skips = !with_own;
  const auto add = [&](double kernel) {
    if (skips) {
      skips = false;
      return;
    }
    step += kernel;
    gains.amplitude += std::abs(kernel);
    gains.impulse = std::max(gains.impulse, std::abs(kernel) / period_s);
    gains.edge = std::max(gains.edge, std::abs(step));
    gains.rate += std::abs(step + at_once) * period_s;
  };
  adjoint.input_kernel(after, input, add, [&](double kernel, double ratio) {
    // The rest decreases in proportion, and so does the distance of the step response from its limit.
    const double rate = gains.rate;
    const double amplitude = gains.amplitude;
    const double from = step;
    add(kernel);
    gains.rate = rate + (gains.rate - rate) / (1 - ratio);
    gains.amplitude = amplitude + (gains.amplitude - amplitude) / (1 - ratio);
    gains.edge = std::max(gains.edge, std::abs(from + (step - from) / (1 - ratio)));
  });
  return gains;
}

}  // namespace swarmcert::stability
