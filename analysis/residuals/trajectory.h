/// @file The second level of a comparison: the closed loop of model and gains follows the log's set points, among
/// neighbours that fly as they were logged, and its positions are held against the measured ones.
///
/// A second run also pushes the vehicle with the force residual that the log shows. What it still misses of the
/// measured peaks is no force of the residual but the loop: gains, estimator, saturation. The ratio of measured to
/// replayed peaks is the factor by which a bound from residuals has to be widened to hold on these flights.
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
  static constexpr double kSettle_s =
      2;  ///< not judged at the start of a piece: the integrator starts at zero
  static constexpr double kShortest_s = 5;  ///< pieces that are shorter are left out

  std::string refused;    ///< why there is nothing; else empty
  double seconds = 0;     ///< judged
  int pieces = 0;         ///< uninterrupted stretches of used records with set points, from a calm moment on
  bool diverged = false;  ///< turned over, or 5 m away
  Axes rmse, max;         ///< simulated minus measured position
  Axes measured_rms, measured_max;    ///< measured position minus set point
  Axes simulated_rms, simulated_max;  ///< the same in the simulation
  Axes replayed_max;                  ///< and in the simulation with the residual as force
};

/// `model` with the motor lag and the delay of gains.toml where it names none: what is flown, and whose residual is
/// replayed. A lag that the loop has may not be in the force as well.
stability::Model with_lag(stability::Model model, const stability::Gains& gains);

/// Flies every piece of a track: from the measured state, sampled loop (stability/simulation/sampled_flight.h) without
/// noise.
/// @param model      with_lag().
/// @param residual_N force residual of `model`, one per record.
/// @param kinds      models of the neighbours are made from it: mass and kind.
TrajectoryErrors fly_along(const stability::Model& model, const stability::Gains& gains, const Kinds& kinds,
                           const Track& track, const std::vector<Eigen::Vector3d>& residual_N);

}  // namespace swarmcert::residuals
