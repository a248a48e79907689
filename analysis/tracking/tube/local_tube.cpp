#include "analysis/tracking/tube/local_tube.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "analysis/tracking/tube/tube_checks.h"

namespace swarmcert::analysis {

namespace {

/// Size of the box on which local constants are computed, relative to the tube.
constexpr double kLocalBox = 1.6;
/// Factor on the number of parts for the sliced tube, where each slice is prepared once or twice, relative to a
/// single radius, where all slices are prepared many times.
constexpr int kSlicedParts = 4;
/// Largest useful width of a tube with one radius for the whole flight, relative to the sliced tube.
constexpr double kWidest = 2.5;
constexpr double kFarthest_m = 0.5;

/// The bound of a row with better constants is at most that of a row with worse constants, so a tube proved by the
/// latter is also proved by the former.
void inherit(LeastTube& better, const LeastTube& worse) {
  if (worse.proved && (!better.proved || worse.radius_m(2) < better.radius_m(2))) better = worse;
}

/// Intersects a tube of one radius, as far as it is proved, with the sliced tube.
LeastTube narrowed(const LeastTube& tube, const SlicedTube& sliced, const Motion& motion) {
  if (!sliced.proved) return tube;
  LeastTube result = tube;
  const Radii radii = sliced.radii();
  std::vector<double> force_N(motion.stretches.size(), 0.0);
  std::vector<TruthSizes> truth(motion.stretches.size());
  for (std::size_t i = 0; i < sliced.truth.size(); ++i) {
    for (std::size_t n = 0; n < sliced.truth[i].size(); ++n) {
      const auto s = static_cast<std::size_t>(motion.stretch_of[i][n]);
      force_N[s] = std::max(force_N[s], sliced.force_error_N[i][n].mag());
      if (truth[s].gradient_N_m.empty()) truth[s] = sliced.truth[i][n];
      unite(truth[s], sliced.truth[i][n]);
    }
  }
  result.radii = tube.proved ? smaller(radii, tube.radii) : radii;
  for (std::size_t s = 0; tube.proved && s < force_N.size(); ++s)
    force_N[s] = std::min(force_N[s], tube.force_N[s]);
  result.force_N = std::move(force_N);
  result.truth = std::move(truth);
  result.proved = true;
  result.why.clear();
  return result;
}

class Steps {
 public:
  Steps(const LocalTubeOptions& options, int total) : options_(options), total_(total) {}
  void next(const std::string& what) {
    if (options_.progress) options_.progress(done_++, total_, what);
  }

 private:
  const LocalTubeOptions& options_;
  int total_, done_ = 0;
};

}  // namespace

double ForceErrorBounds::least_m() const {
  return std::min({by_rate_m, by_amplitude_m, by_edges_m, by_impulse_m, by_slices_m});
}

namespace {

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
  const std::atomic<bool>* const cancelled = options.enclosure.cancelled;
  const auto is_cancelled = [cancelled] { return cancelled != nullptr && *cancelled; };
  const Radii none = Radii::none(vehicles);

  Steps steps(options, 6);
  steps.next("forces at the set points");
  Enclosure at_set_points(scene, options.enclosure);
  const bool has_start = at_set_points.prepare(none, {});
  EnclosureOptions with_progress = options.enclosure;
  const auto show = [&](int step, const char* what) {
    steps.next(what);
    with_progress.progress = [&options, step, what](int done, int total) {
      if (options.progress) options.progress(step * total + done, 6 * total, what);
    };
  };
  if (has_start) {
    const std::vector<double> start_N = at_set_points.sizes(none);
    const double tolerance_N =
        options.enclosure.tolerance * *std::max_element(start_N.begin(), start_N.end());
    show(1, "tube slice by slice");
    EnclosureOptions finer = with_progress;
    finer.boxes *= kSlicedParts;
    result.sliced = sliced_tube(scene, finer, tolerance_N);
    // A tube that is much wider than one already proved adds nothing to it.
    const double wanted_m = result.sliced.proved ? kWidest * result.sliced.radii().largest_position_m()
                                                 : std::numeric_limits<double>::infinity();
    show(2, "tube of one radius");
    Enclosure enclosure(scene, with_progress);
    result.one_radius = least_tube(scene, enclosure, kFarthest_m, wanted_m);
  }
  // If the forces themselves prove no tube of the sampled loop, constants of the network do not either.
  if (is_sampled && has_start && !is_cancelled() && !result.sliced.proved && !result.one_radius.proved) {
    result.why = result.sliced.why;
    return result;
  }
  steps.next("tubes from global constants");
  if (!has_start || is_cancelled()) {
    result.cancelled = true;
    if (!has_start) result.one_radius.why = "interrupted";
  }
  if (has_start && !is_cancelled()) {
    const std::vector<double> start_N = at_set_points.sizes(none);
    const auto per_vehicle = static_cast<std::size_t>(vehicles);
    const GlobalConstants global = global_constants(network, scene.learned(), cancelled);
    const auto row = [&](const char* name, std::vector<ForceConstants> constants) {
      SlopeBound bound(scene, start_N, constants);
      result.rows.push_back({name, std::move(constants), least_tube(scene, bound)});
    };
    row("product", std::vector<ForceConstants>(per_vehicle, global.product));
    row("global", std::vector<ForceConstants>(per_vehicle, global.sdp));
    steps.next("local constants");
    // On the proved tube, or on the errors that would occur without feedback of the errors.
    const LeastTube so_far = narrowed(result.one_radius, result.sliced, scene.motion());
    Radii box = so_far.proved ? so_far.radii.scaled(kLocalBox, 1e-4) : none;
    if (!so_far.proved) {
      SlopeBound still(scene, start_N, std::vector<ForceConstants>(per_vehicle));
      const LeastTube without = least_tube(scene, still);
      if (without.proved) box = without.radii.scaled(kLocalBox, 1e-4);
    }
    std::vector<ForceConstants> local =
        local_constants(network, scene, box, global, options.nodes, options.enclosure.jobs, cancelled,
                        [&](int done, int total) {
                          if (options.progress)
                            options.progress(4 * total + done, 6 * total, "local constants");
                        });
    SlopeBound bound(scene, start_N, local);
    LeastTube of_local = least_tube(scene, bound);
    if (of_local.proved && !of_local.radii.within(box)) {
      of_local = {};
      of_local.why = "its radius lies outside the states for which the local constants hold";
    }
    result.rows.push_back({"local", std::move(local), std::move(of_local)});
    inherit(result.rows[1].tube, result.rows[0].tube);
    inherit(result.rows[2].tube, result.rows[1].tube);
    inherit(result.one_radius, result.rows[2].tube);
    result.cancelled = is_cancelled();
  }
  result.tube = narrowed(result.one_radius, result.sliced, scene.motion());
  if (!result.tube.proved && !result.sliced.why.empty())
    result.tube.why = result.sliced.why + "; with one radius for the whole flight, " + result.tube.why;
  result.proved = result.tube.proved;
  result.why = result.tube.why;
  if (result.proved) {
    const std::vector<ForceConstants> constants =
        result.rows.size() == 3 ? result.rows[2].constants : std::vector<ForceConstants>();
    check_tube(scene, constants, result);
  }
  return result;
}

}  // namespace

LocalTube local_tube(const stability::FlownLoop& stated, const stability::Model& truth,
                     const files::Network& network, const stability::Task& task, int vehicles,
                     const LocalTubeOptions& options) {
  stability::FlownLoop tracking = stated;
  const double truth_lag_s = TruthForce(truth, tracking.plant.largest_thrust_N).motor_lag_s();
  if (truth_lag_s > 0) tracking.gains.motor_lag_s = truth_lag_s;
  if (tracking.gains.rate_hz > 0) {
    LocalTube sampled = tube_of_loop(tracking, truth, network, task, vehicles, options, true);
    if (sampled.proved || sampled.cancelled) return sampled;
    LocalTube continuous = tube_of_loop(tracking, truth, network, task, vehicles, options, false);
    for (stability::Assumption& a : continuous.assumptions) {
      if (a.name.rfind("continuous position loop", 0) == 0)
        a.note = "no tube was proved for the sampled loop (" + sampled.why + "); " + a.note;
    }
    return continuous;
  }
  return tube_of_loop(tracking, truth, network, task, vehicles, options, false);
}

}  // namespace swarmcert::analysis
