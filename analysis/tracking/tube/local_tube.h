/// @file Proved deviation of vehicles from a task when they fly a network under a declared truth, compared with what
/// Lipschitz constants of the network alone would prove.
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
  EnclosureOptions enclosure;  ///< its progress callback is set here
  EstimateErrors estimates;
  /// Interval of the constant motor lag of each vehicle, s, positive; empty: the lag of the truth, or else the stated
  /// one.
  std::optional<Interval> motor_lag_s;
  /// Force measured in flights that acts in addition to the effects of the truth; null: none.
  const ResidualEnvelope* residual = nullptr;
  int nodes = 100;  ///< boxes of branch and bound per local constant
  /// Steps done, total steps, and a description. May be called from any thread.
  std::function<void(int done, int total, const std::string& what)> progress;
};

/// The force error of one vehicle along z within the tube, and the error bound by each disturbance class of the
/// reference. All hold in real arithmetic for the loop of error_loops.h, from rest, up to the end of the task.
struct ForceErrorBounds {
  int vehicle = 0;
  double amplitude_N = 0, rate_N_s = 0, variation_N = 0,
         impulse_N_s = 0;  ///< sup|eps|, sup|eps'|, TV, int|eps| dt
  double lag_m = 0;  ///< contribution of the feedforward lag and of the held command to each of the following
  double by_rate_m = 0, by_amplitude_m = 0, by_edges_m = 0, by_impulse_m = 0;  ///< B1 .. B4
  double by_slices_m = 0;  ///< B2 and B4 evaluated per slice: LocalTube::slices
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
  bool is_sampled = false;   ///< for the loop that holds its command over a period; else for a continuous one
  EstimateErrors estimates;  ///< estimation errors for which it holds
  Interval motor_lag_s;      ///< motor lags for which it holds
  std::string why;           ///< reason if not proved
  LeastTube tube;            ///< the smallest tube that follows from all results below
  LeastTube
      one_radius;  ///< one radius for the whole flight, from the difference of both forces or from the local constants
  SlicedTube sliced;  ///< from the difference of both forces, one interval per slice
  std::vector<TubeRow> rows;
  std::vector<ForceErrorBounds> bounds;  ///< per vehicle; empty if nothing is proved
  std::vector<Deviations> slices;        ///< errors of every vehicle per slice; empty if nothing is proved
  double slice_s = 0, duration_s = 0;
  bool cancelled = false;
  /// Number of residual cells that vehicles in the tube can reach, and of those that no flight visited; 0 without a
  /// residual.
  int residual_cells = 0, residual_cells_without_flights = 0;
  std::vector<stability::Assumption> assumptions;
};

/// Returns the least radii r >= 0 that reproduce themselves: while every vehicle is within r of its setpoint, the force
/// error f_hat - f_a along z, the lag of the feedforward and the truth along x and y push none of them further than r.
/// From rest the errors then stay within r for the whole task. Does the same per slice (sliced_tube()), which needs no
/// loop gain below one over the whole flight. The errors lie in the intersection of both.
///
/// For comparison it also runs least_tube() with constants of the network alone: product of spectral norms, global and
/// local Lipschitz bounds.
/// @param stated gains and model of every vehicle; the motor lag is that of `options`, otherwise that of the truth,
///   otherwise the stated one.
/// @param truth the true force. @param vehicles 2 to 10.
/// @param task a task whose trajectories have enclosures (Task::over()).
/// @return an upper bound in real arithmetic for the loop of error_loops.h under `assumptions`: for the sampled loop
///   if the gains state a rate and it is proved for that loop, otherwise for the continuous one
///   (LocalTube::is_sampled). If `proved` is false nothing is known (inconclusive), for the reason in `why`.
/// @throws files::InputError if the network lacks functions for the kind of these vehicles or has no unit of force.
LocalTube local_tube(const stability::FlownLoop& stated, const stability::Model& truth,
                     const files::Network& network, const stability::Task& task, int vehicles,
                     const LocalTubeOptions& options);

}  // namespace swarmcert::analysis
