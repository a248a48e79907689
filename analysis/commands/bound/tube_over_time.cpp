#include "analysis/commands/bound/tube_over_time.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace swarmcert::analysis {
namespace {

using namespace stability;  // NOLINT: every name below is of that library

constexpr int kTubeSamples = 20001;
constexpr double kTubeHorizon_s = 10, kTubeStep_s = kTubeHorizon_s / (kTubeSamples - 1);

/// Integral of |y| from zero to every sample, times `size`; zeros if `size` is 0.
std::vector<double> areas_of(const TransferFunction& y, double size) {
  std::vector<double> areas(kTubeSamples, 0.0);
  if (size == 0) return areas;
  const std::vector<double> response = sampled_response(y, kTubeStep_s, kTubeSamples);
  for (std::size_t k = 1; k < areas.size(); ++k)
    areas[k] = areas[k - 1] + size * (std::abs(response[k]) + std::abs(response[k - 1])) / 2 * kTubeStep_s;
  return areas;
}

/// Returns why there is no tube; nullptr if there is one.
const char* no_tube(const AxisLoop& loop, const DisturbanceSource& source, int axis) {
  const Disturbance& d = source.axis[axis];
  if (!is_stable(loop)) return "unstable";
  if (!std::isfinite(d.amplitude_N) && !std::isfinite(d.impulse_N_s))
    return "neither amplitude nor impulse is known";
  if (!std::isfinite(source.velocity_error[axis].largest() + source.position_error[axis].largest()))
    return "the amplitude of an estimate's error is not known";
  return nullptr;
}

/// Upper bound of |e(t)| at every `every`-th sample. Estimation errors enter by their amplitude; a delay would only
/// make them act later.
std::vector<ErrorAtTime> tube_of(const AxisLoop& loop, const DisturbanceSource& source, int axis, int every) {
  const Disturbance& d = source.axis[axis];
  const std::vector<double> kernel =
      sampled_response(impulse_transfer(loop, Channel::kForce), kTubeStep_s, kTubeSamples);
  const std::vector<double> velocity_m =
      areas_of(impulse_transfer(loop, Channel::kCommand),
               loop.mass_kg * loop.Kd * source.velocity_error[axis].largest());
  const std::vector<double> position_m =
      areas_of(position_error_transfer(loop), source.position_error[axis].largest());
  double area = 0;
  double peak = 0;
  double step = 0;  // response to a unit step, and its maximum so far
  double step_peak = 0;
  std::vector<ErrorAtTime> at;
  for (int i = 0; i < kTubeSamples; ++i) {
    const auto k = static_cast<std::size_t>(i);
    if (i > 0) area += (std::abs(kernel[k]) + std::abs(kernel[k - 1])) / 2 * kTubeStep_s;
    if (i > 0) step += (kernel[k] + kernel[k - 1]) / 2 * kTubeStep_s;
    peak = std::max(peak, std::abs(kernel[k]));
    step_peak = std::max(step_peak, std::abs(step));
    if (i % every != 0) continue;
    double bound = std::numeric_limits<double>::infinity();
    if (std::isfinite(d.amplitude_N)) bound = area * d.amplitude_N;
    if (std::isfinite(d.impulse_N_s)) {
      // Sum over all passes that have begun by now.
      const double begun = d.pass_period_s > 0 ? 1 + std::floor(i * kTubeStep_s / d.pass_period_s) : d.passes;
      bound = std::min(bound, std::min<double>(d.passes, begun) * peak * d.impulse_N_s);
    }
    if (!source.classes_contain_bias) bound += step_peak * std::abs(source.bias_N[axis]);
    at.push_back({i * kTubeStep_s, bound + velocity_m[k] + position_m[k]});
  }
  return at;
}

}  // namespace

void describe(files::Record& record, const AxisTube& tube) {
  record.field("axis", axis_name(tube.axis), "");
  record.constant("channel", "force", "");
  record.constant("loop", "continuous", "");
  record.field("status", tube.why.empty() ? "estimate" : "inconclusive", "");
  record.may("why", tube.why.empty() ? std::nullopt : std::optional(tube.why), "Why there is no bound.");
  record.field("at", tube.at, "Largest |e| at each time.");
}

std::vector<AxisTube> tubes_over_time(const Tracking& input, const DisturbanceSource& source, int count) {
  std::vector<AxisTube> rows;
  for (int axis = 0; axis < 3; ++axis) {
    const std::optional<AxisLoop> loop = input.continuous(axis);
    if (!loop) continue;
    AxisTube row{axis, "", {}};
    if (const char* const why = no_tube(*loop, source, axis))
      row.why = why;
    else
      row.at = tube_of(*loop, source, axis, (kTubeSamples - 1) / (count - 1));
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace swarmcert::analysis
