/// @file Proved deviation of vehicles from a task when they fly a network under a declared truth.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "analysis/tracking/tube/sliced_tube.h"
#include "stability/bounds/tracking_bounds.h"

namespace swarmcert::analysis {

struct LocalTubeOptions {
  EnclosureOptions enclosure;
  EstimateErrors estimates;
  /// Interval of the constant motor lag of each vehicle, s, positive; empty: the lag of the truth, or else the stated
  /// one.
  std::optional<Interval> motor_lag_s;
  /// Force measured in flights that acts in addition to the effects of the truth; null: none.
  const ResidualEnvelope* residual = nullptr;
};

struct LocalTube {
  bool proved = false;
  bool is_sampled = false;   ///< for the loop that holds its command over a period; else for a continuous one
  EstimateErrors estimates;  ///< estimation errors for which it holds
  Interval motor_lag_s;      ///< motor lags for which it holds
  std::string why;           ///< reason if not proved
  SlicedTube sliced;
  Deviations whole;  ///< over all slices; empty if nothing is proved
  double slice_s = 0, duration_s = 0;
  bool cancelled = false;
  /// Number of residual cells that vehicles in the tube can reach, and of those that no flight visited; 0 without a
  /// residual.
  int residual_cells = 0, residual_cells_without_flights = 0;
  std::vector<stability::Assumption> assumptions;

  /// Returns sup |f_hat - f_a| along z of one vehicle within the tube.
  double largest_force_error_N(std::size_t vehicle) const;
};

/// Returns an interval of the errors of every vehicle per slice that proves itself: while every vehicle is within the
/// tube, the force error f_hat - f_a along z, the lag of the feedforward and the truth along x and y push none of them
/// out of it (sliced_tube()). From rest the errors then stay in it for the whole task.
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
