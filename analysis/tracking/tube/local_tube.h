/// @file How far vehicles stray from a task when they fly a network in the world of a declared truth: proved, and
/// compared with what Lipschitz constants of the network alone would have proved.
#pragma once

#include <atomic>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "analysis/tracking/tube/force_constants.h"
#include "analysis/tracking/tube/least_tube.h"
#include "analysis/tracking/tube/sliced_tube.h"
#include "stability/bounds/tracking_bounds.h"

namespace swarmcert::analysis {

struct LocalTubeOptions {
  EnclosureOptions enclosure;  ///< its progress is set here
  EstimateErrors estimates;
  /// Where the constant lag of each vehicle's motors lies, s, positive; missing: as the truth says, or as stated.
  std::optional<Interval> motor_lag_s;
  /// What acts beside the truth's effects, measured in flights; null: nothing does.
  const ResidualEnvelope* residual = nullptr;
  int nodes = 100;  ///< boxes of branch and bound per local constant
  /// Steps done, of how many; what is being done. From any thread.
  std::function<void(int done, int total, const std::string& what)> progress;
};

/// The force error of one vehicle along z within the tube, and what each bound of the reference makes of it. All hold
/// in real arithmetic for the loop of error_loops.h, from rest, up to the end of the task.
struct ForceErrorBounds {
  int vehicle = 0;
  double amplitude_N = 0, rate_N_s = 0, variation_N = 0,
         impulse_N_s = 0;  ///< sup|eps|, sup|eps'|, TV, int|eps| dt
  double lag_m = 0;  ///< what the lag of the feed-forward and the held command add to each of the following
  double by_rate_m = 0, by_amplitude_m = 0, by_edges_m = 0, by_impulse_m = 0;  ///< B1 .. B4
  double by_slices_m = 0;  ///< B2 and B4 slice by slice: LocalTube::slices
  double least_m() const;
};

/// One way to bound the force error, and the tube that it proves.
struct TubeRow {
  std::string name;                       ///< "product", "global" or "local"
  std::vector<ForceConstants> constants;  ///< per vehicle
  LeastTube tube;
};

struct LocalTube {
  bool proved = false;
  bool is_sampled = false;   ///< of the loop that holds its command over a period; else of a continuous one
  EstimateErrors estimates;  ///< for which it holds
  Interval motor_lag_s;      ///< likewise
  std::string why;           ///< where not proved
  LeastTube tube;            ///< the smallest that follows from all of the following together
  LeastTube
      one_radius;  ///< for the whole flight, from the difference of both forces or from the local constants
  SlicedTube sliced;  ///< from the difference of both forces, an interval per slice
  std::vector<TubeRow> rows;
  std::vector<ForceErrorBounds> bounds;  ///< per vehicle; empty where nothing is proved
  std::vector<Deviations> slices;        ///< errors of every vehicle slice by slice, likewise
  double slice_s = 0, duration_s = 0;
  bool cancelled = false;
  /// Cells of the residual that vehicles in the tube can reach, and those of them that no flight was in; 0 without one.
  int residual_cells = 0, residual_cells_without_flights = 0;
  std::vector<stability::Assumption> assumptions;
};

/// The least radii r >= 0 that the errors reproduce: while every vehicle is within r of its set point, the force error
/// f_hat - f_a along z, the lag of the feed-forward and the truth along x and y push none of them further than r. From
/// rest the errors then stay within r for the whole task. Likewise slice by slice (sliced_tube()), which needs no gain
/// below one over the whole flight. What holds is within both.
///
/// Beside it least_tube() from constants of the network alone: product of spectral norms, global and local Lipschitz
/// bounds.
/// @param stated gains and model of every vehicle; the motors lag as options say, else as the truth
///   says, else as stated.
/// @param truth what the force really is; @param vehicles 2 to 10.
/// @param task one whose trajectories have enclosures (Task::over()).
/// @return an upper bound in real arithmetic of the loop of error_loops.h under `assumptions`: of the sampled loop
///   where gains state a rate and it is proved for that one, else of the continuous one (LocalTube::is_sampled); where
///   `proved` is false nothing is known (inconclusive), for the reason in `why`.
/// @throws files::InputError if the network lacks functions of these vehicles' kind or has no unit of force.
LocalTube local_tube(const stability::TrackingSetup& stated, const stability::Model& truth,
                     const files::Network& network, const stability::Task& task, int vehicles,
                     const LocalTubeOptions& options);

}  // namespace swarmcert::analysis
