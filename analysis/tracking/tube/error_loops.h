/// @file Maps forces over time to tracking errors by the kernels of the position loops.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "nn/base/interval.h"
#include "stability/bounds/enclosures/kernel_cells.h"
#include "stability/bounds/tracking_bounds.h"

namespace swarmcert::analysis {

/// One axis of the loop used in flight, without delay: m D e = s (f_a - f_hat + m x) + s (L - 1)(f_a - m p_d''), with
/// f_a the true force, f_hat the force predicted by the controller, L the lags of its command. x is the difference
/// between the commanded acceleration, which a sampled loop holds over its period, and that of the continuous law
/// (hold_error.h); in a continuous loop it is 0. So e = h' * (f_a - f_hat + m x) + g' * w with
///   h = L^-1[1/(m D)] (command channel),   g = L^-1[(L - 1)/(m D)],   w = f_a - m p_d''.
/// Each entry bounds its kernel in real arithmetic, for every constant motor lag in an interval if one is given.
/// h and g, which do not decay for Ki = 0, may be missing.
struct ErrorLoop {
  std::optional<stability::KernelCells> h, h1, h2;  ///< h, h', h''
  std::optional<stability::KernelCells> h3;         ///< h'''; missing if there is no lag
  std::optional<stability::KernelCells> g, g1, g2;  ///< all missing if there is no lag
  /// e'' is 1/m times w if there is a lag, or 1/m times f_a - f_hat + m x if there is none, minus the response of
  /// this kernel to the same signal, and with a lag plus h''' * (f_a - f_hat + m x).
  std::optional<stability::KernelCells> direct_rest;  ///< missing if the loop is continuous
  /// Whether each cell of a sampled loop spans an integer number of its periods. Then x = (t - t_k) y for
  /// t_k <= t < t_k + T, with y in [c - r, c + r], acts on a kernel k like T/2 y plus a remainder whose mean over each
  /// cell is 0. Integration by parts gives over a cell
  ///   int k x  lies in  T/2 (c int k + [-r, r] int |k|) + [-1, 1] T^2/8 max|y| int |k'|,
  /// because the antiderivative of t - t_k - T/2 that is 0 at both ends of the cell is at most T^2/8. The slopes below
  /// are |k'| for k = h', h'' and h'''. The last one is missing if there is no lag: e'' then follows a force at once.
  bool has_whole_periods = false;
  std::optional<stability::KernelCells> slope1, slope2, slope3;
  /// Maps an error n of the estimated position to int (e + n), m s per m: L^-1[s (s L + Kd)/D]; missing for Ki = 0.
  std::optional<stability::KernelCells> demand;
  bool has_lag = false;
  double mass_kg = 0;
  double Kp = 0, Kd = 0, Ki = 0;
  Interval lags_s;      ///< sum of the time constants
  double period_s = 0;  ///< period of a sampled loop; 0: continuous
};

struct ErrorLoops {
  ErrorLoop axis[3];
  std::string refusal;  ///< why there are no loops; empty if there are
  bool is_sampled() const { return axis[0].period_s > 0; }
};

/// Whether the loops differ only in mass and delay.
bool same_gains_and_lags(const stability::AxisLoop& a, const stability::AxisLoop& b);

/// Returns the loops of all axes with their kernels over `slices` slices, and with the integral gain as the
/// firmware's integration step makes it act.
/// @param is_sampled the command is held over one period of the gains' rate; otherwise the law is continuous.
/// @param motor_lag_s positive: covers the loops for all lags in the interval; if empty, the lag stated by the gains.
ErrorLoops error_loops(const stability::FlownLoop& tracking, double slice_s, int slices,
                       bool is_sampled = false, const std::optional<Interval>& motor_lag_s = {});

/// Bounds of |e| and |e'| in each slice.
struct ErrorHistory {
  std::vector<double> position_m, velocity_m_s;
  void add(const ErrorHistory& other);
};

/// Errors of one axis per slice caused by one newton of excess thrust at t = 0, in m and m/s per N. A lag that starts
/// with this excess adds exp(-t/tau) to the force, so that e = tau h'. For a loop with one lag.
struct LagStart {
  std::vector<Interval> position_m, velocity_m_s;  ///< empty without a lag: the thrust follows at once
  std::vector<Interval> acceleration_m_s2;         ///< m/s^2 per N; empty if the loop is continuous
};
LagStart lag_start(const ErrorLoop& loop, double slice_s);

/// Bounds on the errors of the position and velocity passed to the control law and to the network of a vehicle, per
/// axis, for any course over time. The neighbour states that a vehicle receives have the same error bounds.
struct EstimateErrors {
  double velocity_m_s[3] = {0, 0, 0}, position_m[3] = {0, 0, 0};
  bool are_zero() const;
};

/// Effect of the estimation errors on one axis, per slice: bounds of |e|, |e'| and, if the loop is sampled, |e''|. With
/// errors v of the velocity and n of the position, which a sampled loop sees as staircases, the command is off by
/// Kd v + Kp n + Ki int n, and in a sampled loop its integrator by at most Ki T sup|n| more:
///   |e| <= |h'| * m (Kd sup|v| + (Kp + Ki T) sup|n|) + |h| * m Ki sup|n|.
struct EstimateAnswer {
  ErrorHistory errors;
  std::vector<double> acceleration_m_s2;  ///< empty if the loop is continuous
  double force_N = 0;                     ///< m (Kd sup|v| + (Kp + Ki T) sup|n|)
};
EstimateAnswer estimate_answer(const ErrorLoop& loop, double velocity_m_s, double position_m,
                               std::size_t slices);

}  // namespace swarmcert::analysis
