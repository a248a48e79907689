/// @file What is known of the disturbances of a vehicle, on all axes, and where it comes from.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "stability/bounds/disturbance_bounds.h"
#include "stability/bounds/flown_loop.h"

namespace swarmcert::stability {

/// Norms at t = 0.
struct InitialError {
  double position_m = 0;        ///< |e|
  double velocity_m_s = 0;      ///< |e'|
  double learning_error_N = 0;  ///< |force error|, bias included
};

/// Known bounds on the disturbances, per axis, and their source.
struct DisturbanceSource {
  Disturbance axis[3];
  double rate_norm_N_s = std::numeric_limits<double>::infinity();  ///< d_m: sup |eps'| as a vector
  double bias_N[3] = {0, 0, 0};
  /// True if amplitude and impulse were measured with the bias included; otherwise the bias adds to every class.
  bool classes_contain_bias = false;
  EstimateError velocity_error[3];  ///< estimated - true velocity
  EstimateError position_error[3];  ///< estimated - true position
  ReferenceMotion reference[3];
  bool has_moving_reference() const;
  /// |d|: every rotor gives (1 + d) times the thrust of the model, with the same constant d; see thrust_ratio.h.
  double thrust_ratio_error = 0;
  bool declares_velocity_error = false;  ///< velocity_error was declared, not measured
  bool has_estimate_errors() const;
  /// Returns true if the amplitude is at least the bias on every axis, as it is if measured with the bias included.
  bool amplitudes_reach_bias() const;
  /// Returns all errors on an axis in addition to its class.
  OtherErrors other(int of_axis, const InitialError& initial, const Plant& plant) const;
  /// "declared", "declared truth", "measured" or "rate of f_hat". The last bounds only the learned force, not its
  /// error, and therefore gives no ball.
  std::string kind = "none";
  std::string note;                              ///< on the numbers, for the list of assumptions
  std::vector<std::string> further_assumptions;  ///< that the numbers rely on
  bool bounds_learning_error() const { return kind != "none" && kind != "rate of f_hat"; }
  double f_hat_rate_N_s = 0;  ///< sup |f_hat'|, for the staircase; valid if f_hat_rate_known
  bool f_hat_rate_known = false;
};

/// States that the force error consists of its constant part only.
void declare_no_class(DisturbanceSource& source);

}  // namespace swarmcert::stability
