#include "analysis/tracking/tube/local_tube.h"

#include <algorithm>

#include "analysis/tracking/tube/tube_checks.h"
#include "nn/base/parallel.h"

namespace swarmcert::analysis {

namespace {

/// Largest bound of |f_hat - f_a| along z with every vehicle at its set point.
double at_set_points_N(const Scene& scene, int jobs) {
  const std::vector<Stretch>& stretches = scene.motion().stretches;
  const Deviations none(static_cast<std::size_t>(scene.vehicles()));
  std::vector<double> sizes_N(stretches.size());
  files::parallel_for(static_cast<int>(stretches.size()), jobs, [&](int s) {
    const auto at = static_cast<std::size_t>(s);
    sizes_N[at] = ForceDifference(scene, stretches[at], none).over(none).mag();
  });
  return *std::max_element(sizes_N.begin(), sizes_N.end());
}

LocalTube tube_of_loop(const stability::FlownLoop& tracking, const stability::Model& truth,
                       const files::Network& network, const stability::Task& task, int vehicles,
                       const LocalTubeOptions& options, bool is_sampled) {
  LocalTube result;
  const Scene scene(tracking, truth, network, task, vehicles, network_age_s(tracking.gains, is_sampled),
                    kSlice_s, is_sampled, options.estimates, options.motor_lag_s, options.residual);
  result.why = scene.refusal();
  result.is_sampled = is_sampled;
  result.estimates = options.estimates;
  result.motor_lag_s = scene.motor_lag_s();
  result.duration_s = task.duration_s();
  result.slice_s = scene.motion().slice_s;
  if (!result.why.empty()) return result;
  const double tolerance_N = options.enclosure.tolerance * at_set_points_N(scene, options.enclosure.jobs);
  result.sliced = sliced_tube(scene, options.enclosure, tolerance_N);
  result.proved = result.sliced.proved;
  result.why = result.sliced.why;
  result.cancelled = result.sliced.cancelled;
  if (result.proved) check_tube(scene, result);
  return result;
}

}  // namespace

double LocalTube::largest_force_error_N(std::size_t vehicle) const {
  double largest_N = 0;
  for (const Interval& error_N : sliced.force_error_N[vehicle])
    largest_N = std::max(largest_N, error_N.mag());
  return largest_N;
}

LocalTube local_tube(const stability::FlownLoop& stated, const stability::Model& truth,
                     const files::Network& network, const stability::Task& task, int vehicles,
                     const LocalTubeOptions& options) {
  stability::FlownLoop tracking = stated;
  const double truth_lag_s = TruthForce(truth, tracking.plant.largest_thrust_N).motor_lag_s();
  if (truth_lag_s > 0) tracking.gains.motor_lag_s = truth_lag_s;
  const auto tube = [&](bool is_sampled) {
    return tube_of_loop(tracking, truth, network, task, vehicles, options, is_sampled);
  };
  if (!(tracking.gains.rate_hz > 0)) return tube(false);
  LocalTube sampled = tube(true);
  if (sampled.proved || sampled.cancelled) return sampled;
  LocalTube continuous = tube(false);
  for (stability::Assumption& a : continuous.assumptions)
    if (a.name.rfind("continuous position loop", 0) == 0)
      a.note = "no tube was proved for the sampled loop (" + sampled.why + "); " + a.note;
  return continuous;
}

}  // namespace swarmcert::analysis
