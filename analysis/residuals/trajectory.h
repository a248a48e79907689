/// @file Second level of a comparison: compares a closed-loop simulation along the log's setpoints with the flight.
///
/// The closed loop of model and gains flies among neighbours that fly as logged; its positions are compared with the
/// measured ones.
///
/// A second run also applies the logged force residual to the vehicle. Measured peaks that it still misses are caused
/// not by the residual force but by the loop: gains, estimator, saturation. The ratio of measured to replayed peaks is
/// the factor by which a bound derived from residuals must be widened to hold on these flights.
#pragma once

#include <string>
#include <vector>

#include "analysis/residuals/statistics.h"
#include "analysis/residuals/track.h"
#include "stability/gains.h"
#include "stability/model.h"

namespace swarmcert::residuals {

/// Position errors of one vehicle in one flight, in metres.
struct TrajectoryErrors {
  /// Not judged at the start of a piece, because the integrator starts at zero.
  static constexpr double kSettle_s = 2;
  static constexpr double kShortest_s = 5;  ///< shorter pieces are skipped

  std::string refused;  ///< why there is no result; otherwise empty
  double seconds = 0;   ///< of judged flight
  int pieces = 0;  ///< uninterrupted stretches of used records with setpoints, each from a calm instant on
  bool diverged = false;              ///< the vehicle turned over or was 5 m away
  Axes rmse, max;                     ///< simulated minus measured position
  Axes measured_rms, measured_max;    ///< measured position minus setpoint
  Axes simulated_rms, simulated_max;  ///< the same in simulation
  Axes replayed_max;                  ///< in simulation with the residual applied as a force
};

/// Returns `model` with the motor lag and delay of gains.toml if it has none of its own. It is used both for the
/// simulation and for the replayed residual, because a lag in the loop must not appear in the force as well.
stability::Model with_lag(stability::Model model, const stability::Gains& gains);

/// Simulates each piece of a track from the measured state, with the sampled loop
/// (stability/simulation/sampled_flight.h) and without noise.
/// @param model      result of with_lag()
/// @param residual_N force residual of `model`, one per record
/// @param kinds      kinds and masses from which the models of the neighbours are made
TrajectoryErrors fly_along(const stability::Model& model, const stability::Gains& gains, const Kinds& kinds,
                           const Track& track, const std::vector<Eigen::Vector3d>& residual_N);

}  // namespace swarmcert::residuals
