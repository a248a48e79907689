#include "stability/bounds/loops/reference_jerk.h"

#include <Eigen/Core>
#include <algorithm>
#include <vector>

#include "nn/base/doubles.h"
#include "stability/bounds/loops/kernel_sum.h"
#include "stability/bounds/loops/sampled_adjoint.h"

namespace swarmcert::stability {
namespace {

/// Returns int |C - H| for an output, a row over the state after the control, `phase_s` after that control.
/// @param moves_at_once whether a force acts on the output between that control and the output's time, as it does on e.
/// @param with_own whether the command of the output's own period is included.
double gain_to(const SampledAdjoint& adjoint, const Eigen::RowVectorXd& output, double phase_s,
               bool moves_at_once, bool with_own) {
  std::vector<double> commands;  // the newest first; one more than there are periods of the force's kernel
  const auto keep = [&commands](double kernel) { commands.push_back(kernel); };
  adjoint.command_kernel(output, keep, [](double, double) {});
  if (!with_own) commands.front() = 0;
  KernelSum difference;
  if (moves_at_once) difference.add_linear(0, 1, phase_s);
  std::size_t next = 0;
  adjoint.force_kernel(
      output,
      [&](double start, double slope, double length) {
        difference.add_jump(-commands[next++]);
        difference.add_linear(start, slope, length);
      },
      [&](double start, double slope, double length, double ratio) {
        difference.add_series(-commands[next], start, slope, length, ratio);
      });
  return difference.norms().rate;
}

}  // namespace

double acceleration_age_s(const AxisLoop& loop) {
  double age_s = loop.delay_s;
  for (const double lag_s : loop.lags_s) age_s += lag_s;
  return age_s;
}

double acceleration_age_s(const SampledLoop& loop) { return acceleration_age_s(loop.plant) + loop.period_s; }

double jerk_gain(const AxisLoop& loop) { return loop.mass_kg * lag_floor(loop).rate; }

double jerk_gain(const SampledLoop& loop) {
  const SampledAdjoint adjoint(loop);
  if (!adjoint.is_stable()) return kInfinity;
  constexpr int kPhases = 8;
  const double step_s = loop.period_s / kPhases;
  double most = 0;
  for (int i = 0; i <= kPhases; ++i) {
    const double phase_s = i * step_s;
    most = std::max(most, gain_to(adjoint, adjoint.output_after_control(phase_s), phase_s, true, true));
  }
  const double feedback = gain_to(adjoint, adjoint.model().commanded(), 0, false, false);
  return most + step_s * step_s / 8 * (acceleration_age_s(loop) + feedback);
}

}  // namespace swarmcert::stability
